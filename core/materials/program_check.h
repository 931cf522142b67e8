// SPDX-License-Identifier: Apache-2.0
// Checks of material programs before they reach the GPU (format: shared/material_program.h). A program comes from a
// file or a script and is not trusted: the interpreter reads tables by address and checks nothing. What check_program
// accepts terminates (a section has no jumps and an end) and touches only its own registers, constants and images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace hw {

struct ProgramView {
  const std::uint32_t* words = nullptr;
  std::size_t word_count = 0;
  const float* constants = nullptr;  // 4 floats each
  std::size_t constant_count = 0;    // vec4s
  std::size_t image_count = 0;       // length of the material's image list
};

// An empty string, or what is wrong (row and reason). A program of no words is valid: a surface that does nothing.
std::string check_program(const ProgramView& program);

// Feature bits (shared/features.h) a checked program needs: families of operations and kinds of closures. Reads the
// constants, so that a Principled row with metallic 0 asks for no metal.
std::uint32_t program_features(const ProgramView& program);

// True if what its closures are may depend on the direction or the distance that the surface is seen from.
bool program_depends_on_view(const ProgramView& program);

// Calls `use` with each image index in a checked program and writes back what it returns. For upload: from the
// material's own list to indices into Root::images.
void patch_program_images(std::uint32_t* words, std::size_t word_count,
                          const std::function<std::uint32_t(std::uint32_t)>& use);

// True if the program reads the default UV map or an attribute of this hash (default UV: 0).
bool program_reads_attribute(const ProgramView& program, std::uint32_t hash);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Material programs run on the host, by the same maths headers as the GPU's interpreter (lib/material_vm.glsl). For
// tests: what reads the scene's tables (inputs, attributes, images, tangents) is asked of the caller.
#pragma once

#include <functional>

#include "materials/program_check.h"
#include "shared/material_program.h"

namespace hw {

struct ReferenceInputs {
  vec3 uv{0}, position{0}, normal{0, 0, 1}, incoming{0, 0, 1};
  bool backfacing = false;
  // Result of an INPUT, ATTRIBUTE, TRANSFORM, BUMP or NORMAL_MAP row: opcode, sub, immediate, first operand.
  std::function<vec3(uint op, uint sub, uint imm, vec3 a)> scene;
  // RGBA of an IMAGE row at its coordinates.
  std::function<vec4(uint image, uint sub, vec3 co)> image;
};

struct ReferenceOutput {
  vec3 emission{0}, transparency{0}, holdout{0};
  uint closures = 0;  // rows that add a BSDF; their reflectance is the closures' own affair (lib/closures.h)
};

// Runs a section (HW_SECTION_*) of a checked program.
ReferenceOutput run_program(const ProgramView& program, uint section, const ReferenceInputs& inputs);

}  // namespace hw

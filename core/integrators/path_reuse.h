// SPDX-License-Identifier: Apache-2.0
// Path reuse at the end of a wave: pixels of a group share the light that their paths found at the surface after the
// first (shaders/lib/path_reuse.glsl; decision 0020).
#pragma once

#include "integrators/integrator.h"

namespace hw {

class PathReuse {
 public:
  explicit PathReuse(const IntegratorContext& context);
  // After the last step of a wave whose paths leave places for it. Its queue must be empty.
  void share(Commands& commands);

 private:
  IntegratorContext context_;
  const Kernel &pairs_, &weigh_, &gather_, &prepare_;
};

// Pixels that a wave must hold a multiple of, so that no group is cut: rows of tiles, or blocks of adaptive sampling.
std::uint32_t reuse_wave_pixels(std::uint32_t width, bool adaptive);

// Paths that may go on from a surface beside path reuse, without waves growing for it.
std::uint32_t most_ways_with_reuse(std::uint32_t width);

}  // namespace hw

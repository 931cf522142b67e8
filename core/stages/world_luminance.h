// SPDX-License-Identifier: Apache-2.0
// Measures the world's program on a latitude-longitude grid, for importance sampling.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/device.h"
#include "stages/stage.h"

namespace hw {

// Luminance of the background, width * height floats in the layout of lib/equirect.h (row 0 at v = 0). Each value is
// the mean of 2 x 2 directions within the cell in coarse grids, and of one in fine ones. Throws RenderCancelled soon
// after `cancelled` is set.
std::vector<float> measure_world(Device& device, KernelCache& kernels, const Buffer& root, const Buffer& frame,
                                 const SpecConstants& constants, std::uint32_t width, std::uint32_t height,
                                 const std::atomic<bool>& cancelled);

}  // namespace hw

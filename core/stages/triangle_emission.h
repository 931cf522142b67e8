// SPDX-License-Identifier: Apache-2.0
// Measures what material programs emit over triangle lights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "stages/stage.h"

namespace hw {

// Mean radiance (of the channels) of size * size cells of each light in `lights`, indices of triangle lights; light by
// light, rows of cells as in lib/emission_map.h. Each value is the mean of taps * taps points. Throws RenderCancelled
// soon after `cancelled` is set.
std::vector<float> measure_emission(Device& device, KernelCache& kernels, const Buffer& root, const Buffer& frame,
                                    const SpecConstants& constants, std::span<const std::uint32_t> lights,
                                    std::uint32_t size, std::uint32_t taps, const std::atomic<bool>& cancelled);

}  // namespace hw

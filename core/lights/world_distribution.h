// SPDX-License-Identifier: Apache-2.0
// Importance map of the environment: cumulative distributions over a latitude-longitude grid.
#pragma once

#include <cstdint>
#include <vector>

#include "shared/lights.h"

namespace hw {

// The tables behind WorldDistribution. Upload both and put their addresses into `record`.
struct WorldTables {
  WorldDistribution record{};      // addresses 0 until someone fills them in
  std::vector<float> marginal;     // height + 1
  std::vector<float> conditional;  // height * (width + 1)
  float mean = 0;                  // mean of the values over the sphere of directions
  // `record` with host addresses, for world_sample and world_pdf in C++. Valid while this object is not moved or
  // changed.
  WorldDistribution host() const;
};

// `values`: width * height of luminance (any positive measure of brightness), row 0 at v = 0 (straight down), u as in
// shaders/lib/equirect.h. Negative, infinite and NaN values count as 0. All zero or an empty grid: record.total is 0.
// `compensate`: MIS compensation (Karlik et al. 2019): the mean is taken off, so that samples go where BSDF sampling
// is poor; only for use with MIS, as dark directions are then never sampled.
WorldTables build_world_distribution(const float* values, std::uint32_t width, std::uint32_t height,
                                     bool compensate = false);

}  // namespace hw

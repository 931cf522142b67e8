// SPDX-License-Identifier: Apache-2.0
// How many paths should go on from the first surface that scatters light (FrameParams::bounce_samples), by what
// preparations find: more where the light that bounces arrive with differs from one to the next at the same surface,
// fewer where surfaces themselves differ within a pixel or bounces are dear. The error times the cost of a sample,
// (v0 + vb / k) (c0 + k cb), is least at k = sqrt(vb / v0 * c0 / cb).
//
// Costs are counts of rays, not times: the same scene gives the same picture whatever else the machine does.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "integrators/integrator.h"

namespace hw {

// Of the two paths of each of some pixels. Light that is not finite counts as none.
struct SplitVariance {
  double surfaces;  // v0: of the estimate at a surface with all its bounces known, over the squared mean, pixels' mean
  double bounces;   // vb: of one bounce's light at a given surface, in the same unit
};
SplitVariance split_variance(std::span<const SplitRecord> records);

// Rays of a sample at the first surface that scatters light, and of each bounce from there.
struct SplitCosts {
  double light_rays;    // shadow rays of the first surface
  double bounce_rays;   // that a bounce leads to, itself included
  double bounce_light;  // shadow rays on the way
};
// k, from 1 to 8.
std::uint32_t best_bounce_samples(const SplitVariance& variance, const SplitCosts& costs);

constexpr std::uint32_t kMostBounceSamples = 8;  // a wave has places for them: a group of them at least

class PathSplitting {
 public:
  // Paths are split in so many while they are measured.
  static constexpr std::uint32_t kMeasured = 3;

  // Over so many pixels, of which each has a path in two preparations.
  PathSplitting(const IntegratorContext& context, std::uint32_t pixels);
  // After a wave of the first (0) or second (1) of them.
  void measure(Commands& commands, std::uint32_t which);
  // After both: what is best. Waits for the device.
  std::uint32_t choose(Commands& commands);

 private:
  const IntegratorContext& context_;
  const Kernel& measure_;
  std::uint32_t pixels_;
  Buffer records_;
};

}  // namespace hw

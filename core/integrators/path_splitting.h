// SPDX-License-Identifier: Apache-2.0
// How many paths should go on from the first surface that scatters light (FrameParams::bounce_samples), and whether it
// is cells that should draw their lights, by what preparations find. Paths: more where the light that bounces arrive
// with differs from one to the next at the same surface, fewer where surfaces themselves differ within a pixel or
// bounces are dear. The error times the cost of a sample, (v0 + vb / k) (c0 + k cb), is least at k = sqrt(vb / v0 * c0
// / cb).
//
// Costs are counts of rays, not times: the same scene gives the same picture whatever else the machine does.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "integrators/integrator.h"

namespace hw {

// Of the two paths of each of some pixels. Light that is not finite counts as none.
struct SplitVariance {
  double surfaces;  // v0: of the estimate at a surface with all its bounces known, over the squared mean, pixels' mean
  double bounces;   // vb: of one bounce's light at a given surface, in the same unit
  double kept = 0;  // of that, what path reuse would leave alone
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

// The same where path reuse may be had too: whether pixels share (path_reuse.h), and then k of at most `most`.
// `only_with_reuse`: they do, whatever it costs.
struct PathChoice {
  std::uint32_t bounce_samples;
  bool reuse;
};
PathChoice best_paths(const SplitVariance& variance, const SplitCosts& costs, std::uint32_t most, bool only_with_reuse);

// Whether lights had better be drawn by the tree than by cells: where that is no noisier. It costs two thirds, while
// cells that have learned for a few rounds will halve their variance yet (docs/decisions/0019-cells-or-tree.md).
// Records are of the same pixels, the tree's of paths that are not split. Cells it is where there is too little light
// to tell, or where the tree's paths have met but half of it: what they miss can't be told from their variance.
bool tree_pays(std::span<const SplitRecord> cells, std::span<const SplitRecord> tree);

// Of paths whose lights the tree draws, whether one light sample of a surface does where there were several: where its
// variance is at most 1.4 times theirs as measured, which is less than it is where noise is high.
bool one_light_sample_pays(std::span<const SplitRecord> several, std::span<const SplitRecord> one);

// Pixels that both need to go by: two paths of each say little.
constexpr std::uint32_t kFewestCompared = 2048;

constexpr std::uint32_t kMostBounceSamples = 8;  // a wave has places for them: a group of them at least

class PathSplitting {
 public:
  // Paths are split in so many while they are measured.
  static constexpr std::uint32_t kMeasured = 3;

  // Over so many pixels, of which each has a path in two preparations.
  PathSplitting(const IntegratorContext& context, std::uint32_t pixels);
  // After a wave of the first (0) or second (1) of them.
  void measure(Commands& commands, std::uint32_t which);
  // After both: what is best, with path reuse or without, or what is left to choose of it. Waits for the device.
  PathChoice choose(Commands& commands, bool only_with_reuse);
  // After a wave of the first (0) or second (1) of two more preparations, over the same pixels, whose paths drew lights
  // by the tree and were not split.
  void measure_tree(Commands& commands, std::uint32_t which);
  // After those: tree_pays(). Waits for the device.
  bool chooses_tree(Commands& commands);
  // The same of two more, whose paths had one light sample of each surface: one_light_sample_pays().
  void measure_one_light_sample(Commands& commands, std::uint32_t which);
  bool chooses_one_light_sample(Commands& commands);

 private:
  void measure(Commands& commands, std::uint32_t which, const Buffer& records);
  std::vector<SplitRecord> read(const Buffer& records) const;

  const IntegratorContext& context_;
  const Kernel& measure_;
  std::uint32_t pixels_;
  Buffer records_, tree_records_;
};

}  // namespace hw

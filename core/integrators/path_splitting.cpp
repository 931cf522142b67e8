// SPDX-License-Identifier: Apache-2.0
// The measure and the choice.
#include "integrators/path_splitting.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "integrators/path_reuse.h"

namespace hw {

namespace {

// Costs in units of tracing a ray and running the program of what it meets; rough figures from lavapipe 22.3.6 and
// Embree over scenes/benchmark.
constexpr double kCamera = 2.4;       // with what the film costs
constexpr double kLightSample = 0.7;  // with its shadow ray
constexpr double kRay = 0.5;
constexpr double kSurface = 1.2;  // of a bounce: its program, and a light sample with its shadow ray
// What path reuse leaves of the variance of what is shared, and what it costs a bounce: measured, in rooms and heads
// (docs/measurements/path_reuse.md).
constexpr double kLeftByReuse = 0.3;
constexpr double kReuse = 2.0;
// Fewer pixels of light than this say nothing.
constexpr std::size_t kFewest = 64;

bool good(const SplitRecord& r) {
  return std::isfinite(r.light[0]) && std::isfinite(r.light[1]) && std::isfinite(r.apart[0]) &&
         std::isfinite(r.apart[1]) && std::isfinite(r.kept[0]) && std::isfinite(r.kept[1]);
}

double light_of(const SplitRecord& r) { return 0.5 * (double(r.light[0]) + r.light[1]); }

// Variance of the pixel's two paths, each as it would be were it not split.
double unsplit_variance(const SplitRecord& r) {
  const double difference = double(r.light[0]) - r.light[1], apart = double(r.apart[0]) + r.apart[1];
  constexpr double k = PathSplitting::kMeasured;
  return 0.5 * difference * difference + (1 - 1 / k) * k * k * 0.25 * apart;
}

// Of two estimators' samples of the same pixels, none of them split, in one unit. Nothing where there is too little
// light to tell, or the second has met but half of it.
std::optional<std::pair<double, double>> variances(std::span<const SplitRecord> first,
                                                   std::span<const SplitRecord> second) {
  if (first.size() != second.size()) return {};
  double by_first = 0, by_second = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    if (good(first[i]) && good(second[i])) by_first += light_of(first[i]), by_second += light_of(second[i]), ++count;
  if (count < kFewestCompared || !(by_second > 0) || by_second < 0.5 * by_first) return {};
  // Relative to what four paths say of the pixel, which noise makes too bright or too dark: so the picture's mean
  // counts as much.
  const double mean = 0.5 * (by_first + by_second) / double(count);
  std::pair<double, double> v{0, 0};
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!good(first[i]) || !good(second[i])) continue;
    const double light = 0.5 * (light_of(first[i]) + light_of(second[i]));
    const double weight = 1 / (light * light + mean * mean);
    v.first += weight * unsplit_variance(first[i]);
    v.second += weight * unsplit_variance(second[i]);
  }
  return v;
}

}  // namespace

SplitVariance split_variance(std::span<const SplitRecord> records) {
  double mean = 0;
  std::size_t count = 0;
  for (const SplitRecord& r : records)
    if (good(r)) mean += light_of(r), ++count;
  SplitVariance v{0, 0};
  if (count < kFewest || !(mean > 0)) return v;
  // What is darker than a tenth of the mean counts as if it were that bright.
  const double dark = 0.1 * mean / double(count);
  double all = 0, apart = 0, kept = 0;
  for (const SplitRecord& r : records) {
    if (!good(r)) continue;
    const double light = light_of(r), difference = double(r.light[0]) - r.light[1];
    const double weight = 1 / (light * light + dark * dark);
    all += 0.5 * difference * difference * weight;
    apart += 0.25 * (double(r.apart[0]) + r.apart[1]) * weight;
    kept += 0.25 * (double(r.kept[0]) + r.kept[1]) * weight;
  }
  // Parts are thirds: the variance of one that is whole is nine times theirs, that of the mean of three a third of it.
  constexpr double k = PathSplitting::kMeasured;
  v.bounces = k * k * apart / double(count);
  v.kept = k * k * kept / double(count);
  v.surfaces = std::max(all / double(count) - v.bounces / k, 0.0);
  return v;
}

namespace {

// The best k of at most `most`, and error times cost there.
std::pair<std::uint32_t, double> least_cost(double surfaces, double bounces, double c0, double cb, std::uint32_t most) {
  const auto cost = [&](std::uint32_t k) { return (surfaces + bounces / k) * (c0 + k * cb); };
  std::uint32_t best = 1;
  for (std::uint32_t k = 2; k <= most; ++k)
    if (cost(k) < cost(best)) best = k;
  return {best, cost(best)};
}

double surface_cost(const SplitCosts& costs) { return kCamera + kLightSample * costs.light_rays; }
double bounce_cost(const SplitCosts& costs) { return kRay * costs.bounce_rays + kSurface * costs.bounce_light; }

}  // namespace

std::uint32_t best_bounce_samples(const SplitVariance& v, const SplitCosts& costs) {
  if (!(v.bounces > 0)) return 1;
  return least_cost(v.surfaces, v.bounces, surface_cost(costs), bounce_cost(costs), kMostBounceSamples).first;
}

PathChoice best_paths(const SplitVariance& v, const SplitCosts& costs, std::uint32_t most, bool only_with_reuse) {
  const std::uint32_t alone = best_bounce_samples(v, costs);
  if (!(v.bounces > 0)) return {only_with_reuse ? 1 : alone, only_with_reuse};
  const double c0 = surface_cost(costs), cb = bounce_cost(costs);
  const double left = std::min(v.kept + kLeftByReuse * std::max(v.bounces - v.kept, 0.0), v.bounces);
  const auto apart = least_cost(v.surfaces, v.bounces, c0, cb, kMostBounceSamples);
  const auto shared = least_cost(v.surfaces, left, c0, cb + kReuse, std::min(most, kMostBounceSamples));
  return only_with_reuse || shared.second < apart.second ? PathChoice{shared.first, true} : PathChoice{alone, false};
}

bool tree_pays(std::span<const SplitRecord> cells, std::span<const SplitRecord> tree) {
  const auto v = variances(cells, tree);
  return v && v->second <= v->first;
}

bool one_light_sample_pays(std::span<const SplitRecord> several, std::span<const SplitRecord> one) {
  const auto v = variances(several, one);
  return v && v->second <= 1.4 * v->first;
}

PathSplitting::PathSplitting(const IntegratorContext& context, std::uint32_t pixels)
    : context_(context),
      measure_(context.kernels.get("split_measure", context.constants)),
      pixels_(pixels),
      records_(context.device, pixels * sizeof(SplitRecord), BufferUse::device, "split paths"),
      tree_records_(context.device, pixels * sizeof(SplitRecord), BufferUse::device, "paths by the light tree") {}

void PathSplitting::measure(Commands& commands, std::uint32_t which) { measure(commands, which, records_); }

void PathSplitting::measure_tree(Commands& commands, std::uint32_t which) { measure(commands, which, tree_records_); }

void PathSplitting::measure(Commands& commands, std::uint32_t which, const Buffer& records) {
  const Push push{.out_queue = records.address(), .a = which};
  const std::uint32_t paths = context_.wave.params().wave_pixels;
  commands.dispatch(measure_, push.bytes(), (paths + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE);
}

PathChoice PathSplitting::choose(Commands& commands, bool only_with_reuse) {
  Wave& wave = context_.wave;
  wave.record_counters(commands);
  commands.flush();
  const RayCounters rays = wave.counters();
  // All preparations so far were counted: as many before the measured ones, with one bounce a path, as measured ones.
  const double bounces = double(rays.camera) * 0.5 * (1 + kMeasured);
  const double first = std::min(double(rays.shadow), double(rays.camera) * wave.light_samples());
  const SplitCosts costs = {first / std::max(double(rays.camera), 1.0), double(rays.indirect) / std::max(bounces, 1.0),
                            (double(rays.shadow) - first) / std::max(bounces, 1.0)};
  const SplitVariance variance = split_variance(read(records_));
  if (!wave.path_reuse()) return {best_bounce_samples(variance, costs), false};
  return best_paths(variance, costs, most_ways_with_reuse(context_.width), only_with_reuse);
}

bool PathSplitting::chooses_tree(Commands& commands) {
  commands.flush();
  return tree_pays(read(records_), read(tree_records_));
}

// The cells' records have been read: their place is free.
void PathSplitting::measure_one_light_sample(Commands& commands, std::uint32_t which) {
  measure(commands, which, records_);
}

bool PathSplitting::chooses_one_light_sample(Commands& commands) {
  commands.flush();
  return one_light_sample_pays(read(tree_records_), read(records_));
}

std::vector<SplitRecord> PathSplitting::read(const Buffer& records) const {
  std::vector<SplitRecord> found(pixels_);
  context_.device.read(records, 0, std::as_writable_bytes(std::span(found)));
  return found;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Classes by greedy merging of the feature sets that occur, by an estimate of what shading costs with each.
#include "scene/shading_classes.h"

#include <algorithm>
#include <cmath>

#include "shared/features.h"
#include "shared/material_program.h"

namespace hw {
namespace {

constexpr std::uint32_t vm(std::uint32_t family) { return family << HW_FEATURE_VM_SHIFT; }

// What a feature adds to shading one hit when every branch runs, in units of a diffuse closure; rough figures from
// leaving features out of the kernels on lavapipe 22.3.6.
constexpr struct {
  std::uint32_t feature;
  float cost;
} kCosts[] = {
    {HW_FEATURE_GLOSSY, 4},       {HW_FEATURE_METALLIC, 3},     {HW_FEATURE_CONDUCTOR, 3},
    {HW_FEATURE_TRANSMISSION, 6}, {HW_FEATURE_TRANSLUCENT, 1},  {HW_FEATURE_SHEEN, 3},
    {HW_FEATURE_COAT, 5},         {HW_FEATURE_ANISOTROPY, 2},   {HW_FEATURE_ROUGH_DIFFUSE, 2},
    {HW_FEATURE_TOON, 1},         {HW_FEATURE_MULTISCATTER, 1}, {vm(HW_VM_MATH), 2},
    {vm(HW_VM_TABLE), 2},         {vm(HW_VM_INPUT), 5},         {vm(HW_VM_IMAGE), 6},
    {vm(HW_VM_COLOR), 2},         {vm(HW_VM_NORMAL), 4},        {vm(HW_VM_NOISE), 60},
    {vm(HW_VM_VORONOI), 60},      {vm(HW_VM_PATTERN), 20},      {vm(HW_VM_BSDF), 8},
    {vm(HW_VM_PRINCIPLED), 6},    {HW_FEATURE_IMAGE_MODES, 4},
};
constexpr float kBaseCost = 15;
// One more class means more kernels to load and smaller dispatches: classes are merged while that costs less than this
// share of all shading.
constexpr float kClassCost = 0.04f;

float cost(std::uint32_t features) {
  float sum = kBaseCost;
  for (const auto& c : kCosts)
    if (features & c.feature) sum += c.cost;
  return sum;
}

struct Group {
  std::uint32_t features;
  float weight;
};

}  // namespace

std::uint32_t ShadingClasses::class_of(std::uint32_t needs) const {
  for (std::size_t i = 0; i < features.size(); ++i)
    if ((needs & ~features[i]) == 0) return static_cast<std::uint32_t>(i);
  return static_cast<std::uint32_t>(features.size() - 1);
}

ShadingClasses choose_shading_classes(const std::map<std::uint32_t, std::size_t>& objects) {
  ShadingClasses classes;
  std::vector<Group> groups;
  float total = 0;
  for (const auto& [features, count] : objects) {
    classes.all |= features;
    // How much of the picture objects cover is not known here: a thousand pebbles count for more than one floor, but
    // not for a thousand.
    groups.push_back({features, std::sqrt(float(count))});
  }
  if (groups.empty()) return classes;
  // Many distinct sets: begin with what is cheap to merge, so that the search below stays small.
  while (groups.size() > 48) {
    groups[groups.size() - 2].features |= groups.back().features;
    groups[groups.size() - 2].weight += groups.back().weight;
    groups.pop_back();
  }
  for (const Group& g : groups) total += g.weight * cost(g.features);
  // Merge the two groups that lose least by it, as long as there are too many or it loses little.
  while (groups.size() > 1) {
    std::size_t best_a = 0, best_b = 1;
    float least = HUGE_VALF;
    for (std::size_t a = 0; a < groups.size(); ++a)
      for (std::size_t b = a + 1; b < groups.size(); ++b) {
        const float merged = (groups[a].weight + groups[b].weight) * cost(groups[a].features | groups[b].features);
        const float loss =
            merged - groups[a].weight * cost(groups[a].features) - groups[b].weight * cost(groups[b].features);
        if (loss < least) least = loss, best_a = a, best_b = b;
      }
    if (groups.size() <= HW_MAX_SHADING_CLASSES && least > kClassCost * total) break;
    groups[best_a].features |= groups[best_b].features;
    groups[best_a].weight += groups[best_b].weight;
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(best_b));
  }
  // Cheapest first: an object that several classes could shade takes the cheapest.
  std::sort(groups.begin(), groups.end(),
            [](const Group& a, const Group& b) { return cost(a.features) < cost(b.features); });
  classes.features.clear();
  for (const Group& g : groups) classes.features.push_back(g.features);
  return classes;
}

}  // namespace hw

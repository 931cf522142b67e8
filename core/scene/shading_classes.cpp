// SPDX-License-Identifier: Apache-2.0
// Choice of the simple class: the union of feature sets that makes the estimated cost of all objects least.
#include "scene/shading_classes.h"

#include <vector>

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
    {HW_FEATURE_GLOSSY, 4},         {HW_FEATURE_METALLIC, 3},      {HW_FEATURE_CONDUCTOR, 3},     {HW_FEATURE_TRANSMISSION, 6},
    {HW_FEATURE_TRANSLUCENT, 1},    {HW_FEATURE_SHEEN, 3},         {HW_FEATURE_COAT, 5},          {HW_FEATURE_ANISOTROPY, 2},
    {HW_FEATURE_ROUGH_DIFFUSE, 2},  {HW_FEATURE_TOON, 1},          {HW_FEATURE_MULTISCATTER, 1},  {vm(HW_VM_MATH), 2},
    {vm(HW_VM_TABLE), 2},           {vm(HW_VM_INPUT), 5},          {vm(HW_VM_IMAGE), 6},          {vm(HW_VM_COLOR), 2},
    {vm(HW_VM_NORMAL), 4},          {vm(HW_VM_NOISE), 60},         {vm(HW_VM_VORONOI), 60},       {vm(HW_VM_PATTERN), 20},
    {vm(HW_VM_BSDF), 8},            {vm(HW_VM_PRINCIPLED), 6},
};
constexpr float kBaseCost = 15;
// A second class means more kernels to load and smaller dispatches: it must pay for that.
constexpr float kWorthIt = 0.9f;

float cost(std::uint32_t features) {
  float sum = kBaseCost;
  for (const auto& c : kCosts)
    if (features & c.feature) sum += c.cost;
  return sum;
}

}  // namespace

ShadingClasses choose_shading_classes(const std::map<std::uint32_t, std::size_t>& objects) {
  ShadingClasses classes;
  float objects_total = 0;
  for (const auto& [features, count] : objects) {
    classes.all |= features;
    objects_total += float(count);
  }
  classes.simple = classes.all;
  // Candidates: every set that occurs, and the union of every two. Scenes have few distinct sets; beyond a bound the
  // pairs are left out.
  std::vector<std::uint32_t> candidates;
  for (const auto& [a, count] : objects) candidates.push_back(a);
  const std::size_t singles = candidates.size();
  if (singles <= 64)
    for (std::size_t i = 0; i < singles; ++i)
      for (std::size_t j = i + 1; j < singles; ++j) candidates.push_back(candidates[i] | candidates[j]);
  const float whole = cost(classes.all);
  float best = objects_total * whole * kWorthIt;
  for (std::uint32_t candidate : candidates) {
    if (candidate == classes.all) continue;
    const float simple = cost(candidate);
    float total = 0;
    for (const auto& [features, count] : objects) total += float(count) * ((features & ~candidate) ? whole : simple);
    if (total < best) {
      best = total;
      classes.simple = candidate;
      classes.split = true;
    }
  }
  return classes;
}

}  // namespace hw

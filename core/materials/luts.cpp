// SPDX-License-Identifier: Apache-2.0
// The stored albedo tables, expanded to floats (layout: shaders/lib/luts.h).
#include "materials/luts.h"

#include <cstdint>
#include <iterator>

namespace hw {
namespace {

// Integrals in 1/65535; made by tools/make_albedo_tables.cpp.
constexpr std::uint16_t kIntegrals[] = {
#include "materials/albedo_tables.inc"
};

// Blender 5.0's sheen, [a, b, albedo][roughness][cosine]; measured by blender_tests/measure_sheen.py.
constexpr float kSheen[] = {
#include "materials/sheen_table.inc"
};

static_assert(std::size(kIntegrals) == HW_LUT_SHEEN);
static_assert(HW_LUT_SHEEN + std::size(kSheen) == HW_LUT_COUNT);

std::vector<float> expand() {
  std::vector<float> table;
  table.reserve(HW_LUT_COUNT);
  for (std::uint16_t v : kIntegrals) table.push_back(float(v) / 65535.0f);
  table.insert(table.end(), std::begin(kSheen), std::end(kSheen));
  return table;
}

}  // namespace

std::span<const float> albedo_lut_table() {
  static const std::vector<float> table = expand();
  return table;
}

const float* albedo_luts() { return albedo_lut_table().data(); }

}  // namespace hw

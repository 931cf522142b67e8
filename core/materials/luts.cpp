// SPDX-License-Identifier: Apache-2.0
// The stored albedo tables, expanded to floats (layout: shaders/lib/luts.h).
#include "materials/luts.h"

#include <algorithm>
#include <bit>
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

std::vector<std::uint64_t> albedo_lut_words() {
  // Points along the fastest axis of each table; the last entry of a row or plane has no cell, and what it holds is
  // never read.
  constexpr struct {
    std::uint32_t first, row;
  } kTables[] = {{HW_LUT_E, 32},         {HW_LUT_E_MEAN, 32},         {HW_LUT_GLASS, 16},    {HW_LUT_GLASS_MEAN, 16},
                 {HW_LUT_GLASS_INV, 16}, {HW_LUT_GLASS_INV_MEAN, 16}, {HW_LUT_RISE_IOR, 16}, {HW_LUT_RISE_SCHLICK, 16}};
  std::vector<std::uint64_t> words;
  words.reserve(HW_LUT_COUNT);
  for (std::size_t t = 0; t < std::size(kTables); ++t) {
    const std::uint32_t end = t + 1 < std::size(kTables) ? kTables[t + 1].first : HW_LUT_SHEEN;
    for (std::uint32_t i = kTables[t].first; i < end; ++i) {
      const auto at = [&](std::uint32_t step) {
        return std::uint64_t(kIntegrals[std::min(i + step, HW_LUT_SHEEN - 1)]);
      };
      const std::uint32_t row = kTables[t].row;
      words.push_back(at(0) | at(1) << 16 | at(row) << 32 | at(row + 1) << 48);
    }
  }
  for (std::size_t i = 0; i < std::size(kSheen); ++i) {
    const float next = kSheen[std::min(i + 1, std::size(kSheen) - 1)];
    words.push_back(std::bit_cast<std::uint32_t>(kSheen[i]) | std::uint64_t(std::bit_cast<std::uint32_t>(next)) << 32);
  }
  return words;
}

const float* albedo_luts() { return albedo_lut_table().data(); }

}  // namespace hw

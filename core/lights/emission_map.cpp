// SPDX-License-Identifier: Apache-2.0
// Emission maps from measured cells.
#include "lights/emission_map.h"

#include <algorithm>

#include "lights/cumulative.h"

namespace hw {
namespace {

constexpr double kFloor = 1.0 / 32;  // of the mean, that any cell has
constexpr float kVaries = 1.5f;      // times the mean

float usable(float v) { return v > 0 && v <= 3.4e38f ? v : 0.0f; }

}  // namespace

float emission_mean(std::span<const float> cells) {
  double sum = 0;
  for (float v : cells) sum += usable(v);
  return cells.empty() ? 0.0f : static_cast<float>(sum / static_cast<double>(cells.size()));
}

bool emission_varies(std::span<const float> cells) {
  float most = 0;
  for (float v : cells) most = std::max(most, usable(v));
  return most > kVaries * emission_mean(cells);
}

std::uint32_t append_emission_map(std::span<const float> cells, std::uint32_t size, std::vector<float>& maps) {
  const auto at = static_cast<std::uint32_t>(maps.size());
  const double mean = emission_mean(cells), least = mean > 0 ? kFloor * mean : 1.0;
  maps.resize(at + emission_map_floats(size));
  maps[at] = static_cast<float>(size);
  std::vector<double> row(size), rows(size);
  double total = 0;
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) row[x] = std::max<double>(usable(cells[std::size_t{y} * size + x]), least);
    for (double v : row) rows[y] += v;
    accumulate(row, rows[y], maps.data() + at + 1 + std::size_t{y + 1} * (size + 1));
    total += rows[y];
  }
  accumulate(rows, total, maps.data() + at + 1);
  return at;
}

}  // namespace hw

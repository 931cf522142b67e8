// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions of the environment map. Rows are weighted by the solid angle of their cells.
#include "lights/world_distribution.h"

#include <algorithm>
#include <cmath>

#include "lights/cumulative.h"

namespace hw {
namespace {

float usable(float v) { return v > 0 && v <= 3.4e38f ? v : 0.0f; }

}  // namespace

WorldDistribution WorldTables::host() const {
  WorldDistribution w = record;
  w.marginal = reinterpret_cast<std::uint64_t>(marginal.data());
  w.conditional = reinterpret_cast<std::uint64_t>(conditional.data());
  return w;
}

WorldTables build_world_distribution(const float* values, std::uint32_t width, std::uint32_t height, bool compensate) {
  WorldTables t;
  t.record.width = width;
  t.record.height = height;
  if (width == 0 || height == 0 || values == nullptr) return t;
  const std::size_t w = width, h = height;

  std::vector<double> row_area(h);  // share of the sphere of one row; they sum to 1
  for (std::size_t y = 0; y < h; ++y) {
    const double a = M_PI * static_cast<double>(y) / static_cast<double>(h);
    const double b = M_PI * static_cast<double>(y + 1) / static_cast<double>(h);
    row_area[y] = 0.5 * (std::cos(a) - std::cos(b));
  }
  double mean = 0;
  for (std::size_t y = 0; y < h; ++y) {
    double sum = 0;
    for (std::size_t x = 0; x < w; ++x) sum += usable(values[y * w + x]);
    mean += sum * row_area[y] / static_cast<double>(w);
  }
  t.mean = static_cast<float>(mean);
  t.marginal.resize(h + 1);
  t.conditional.resize(h * (w + 1));

  std::vector<double> row(w), rows(h);
  const auto fill = [&](double offset) {
    double total = 0;
    for (std::size_t y = 0; y < h; ++y) {
      double sum = 0;
      for (std::size_t x = 0; x < w; ++x) {
        row[x] = std::max(0.0, static_cast<double>(usable(values[y * w + x])) - offset);
        sum += row[x];
      }
      accumulate(row, sum, t.conditional.data() + y * (w + 1));
      rows[y] = sum * row_area[y] / static_cast<double>(w);
      total += rows[y];
    }
    accumulate(rows, total, t.marginal.data());
    return total;
  };
  double total = fill(compensate ? mean : 0.0);
  // A constant environment has nothing left after compensation: sample it as it is.
  if (compensate && !(total > 1e-6 * mean)) total = fill(0.0);
  t.record.total = static_cast<float>(total);
  if (total > 0 && !(t.record.total > 0)) t.record.total = 1e-37f;
  return t;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Vose's construction of an alias table (Vose 1991, "A Linear Algorithm for Generating Random Numbers with a Given
// Distribution"), in double precision, with the pdf taken from the table as it was rounded.
#include "lights/alias_table.h"

#include <cmath>
#include <cstdint>

namespace hw {

std::vector<AliasEntry> build_alias_table(std::span<const float> weights) {
  const std::size_t n = weights.size();
  std::vector<AliasEntry> table(n, AliasEntry{1.0f, 0, 0.0f});
  double total = 0;
  for (float w : weights) total += w;
  for (std::size_t i = 0; i < n; ++i) table[i].alias = static_cast<std::uint32_t>(i);
  if (!(total > 0)) return table;

  // Weights in units of the mean; entries below 1 on one stack, the others on another, in one array from both ends.
  std::vector<double> scaled(n);
  std::vector<std::uint32_t> stack(n);
  std::size_t small_end = 0, large_begin = n;
  std::uint32_t heaviest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    scaled[i] = weights[i] / total * static_cast<double>(n);
    if (weights[i] > weights[heaviest]) heaviest = static_cast<std::uint32_t>(i);
    if (scaled[i] < 1) {
      stack[small_end++] = static_cast<std::uint32_t>(i);
    } else {
      stack[--large_begin] = static_cast<std::uint32_t>(i);
    }
  }
  while (small_end > 0 && large_begin < n) {
    const std::uint32_t s = stack[--small_end];
    const std::uint32_t l = stack[large_begin];
    table[s].threshold = static_cast<float>(scaled[s]);
    table[s].alias = l;
    scaled[l] -= 1 - scaled[s];
    if (scaled[l] < 1) {
      ++large_begin;
      stack[small_end++] = l;
    }
  }
  // What is left has weight 1 up to rounding, unless it is an entry of weight 0 that ran out of partners.
  while (small_end > 0) {
    const std::uint32_t s = stack[--small_end];
    if (!(weights[s] > 0)) {
      table[s].threshold = 0;
      table[s].alias = heaviest;
    }
  }

  std::vector<double> realised(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = table[i].threshold;
    realised[i] += t;
    realised[table[i].alias] += 1 - t;
  }
  for (std::size_t i = 0; i < n; ++i) table[i].pdf = static_cast<float>(realised[i] / static_cast<double>(n));
  return table;
}

}  // namespace hw

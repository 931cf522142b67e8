// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions, summed up in double precision.
#include "lights/cumulative.h"

#include <algorithm>

namespace hw {

void accumulate(std::span<const double> values, double sum, float* out) {
  const std::size_t n = values.size();
  double running = 0;
  out[0] = 0;
  for (std::size_t i = 0; i < n; ++i) {
    running += values[i];
    out[i + 1] = sum > 0 ? std::min(1.0f, static_cast<float>(running / sum)) : 0.0f;
  }
  if (!(sum > 0)) return;
  // Rounding must not leave the last cells that have weight without reach, nor give weight to those that have none.
  std::size_t last = n;
  while (last > 1 && !(values[last - 1] > 0)) --last;
  for (std::size_t i = last; i <= n; ++i) out[i] = 1;
}

}  // namespace hw

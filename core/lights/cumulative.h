// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions of piecewise constant densities, as lib/cumulative.h reads them.
#pragma once

#include <cstddef>
#include <span>

namespace hw {

// Of `values` (finite, not negative) with the sum `sum`, into values.size() + 1 floats at `out` that never fall and end
// in exactly 1; all 0 when the sum is 0.
void accumulate(std::span<const double> values, double sum, float* out);

}  // namespace hw

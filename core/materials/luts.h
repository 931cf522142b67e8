// SPDX-License-Identifier: Apache-2.0
// Albedo look-up tables of the closures. Layout and meaning: shaders/lib/luts.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/luts.h"

namespace hw {

// All tables, HW_LUT_COUNT floats. Expanded on the first call (20 microseconds); thread safe.
std::span<const float> albedo_lut_table();

// The same as HW_LUT_COUNT words for Root::luts, as lib/luts.h lays them out.
std::vector<std::uint64_t> albedo_lut_words();

// The tables but the sheen's (HW_LUT_SHEEN floats), integrated anew with 2 n^2 points an entry (0.25 s for n = 16 on
// two cores). The stored ones are n = 160: converged to 3e-5 root mean square, and stored to 1.5e-5.
std::vector<float> integrate_albedo_luts(int n);

}  // namespace hw

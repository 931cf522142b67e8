// SPDX-License-Identifier: Apache-2.0
// Alias tables: choosing one of n with given odds in constant time (Walker 1977, Vose 1991).
#pragma once

#include <span>
#include <vector>

#include "shared/lights.h"

namespace hw {

// One entry for each weight, in O(n). Weights must be finite and not negative. `pdf` is the probability that choosing
// by the table's own single-precision thresholds gives the entry; an entry of weight 0 has pdf 0 and is never chosen.
// All weights 0 (or none): every entry has pdf 0, and the table must not be sampled.
std::vector<AliasEntry> build_alias_table(std::span<const float> weights);

}  // namespace hw

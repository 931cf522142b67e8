// SPDX-License-Identifier: Apache-2.0
// Writes core/materials/albedo_tables.inc to standard output. From the repository's root (half a minute):
//   g++ -O2 -std=c++20 -Icore -Ishaders -DGLM_FORCE_XYZW_ONLY tools/make_albedo_tables.cpp
//   core/materials/lut_quadrature.cpp
//     -o build/make_albedo_tables && build/make_albedo_tables > core/materials/albedo_tables.inc
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "materials/luts.h"

int main() {
  const std::vector<float> table = hw::integrate_albedo_luts(160);
  std::puts("// SPDX-License-Identifier: Apache-2.0\n// Written by tools/make_albedo_tables.cpp; not to be edited.");
  for (size_t i = 0; i < table.size(); ++i) {
    std::printf("%d,%s", int(std::lround(std::clamp(table[i], 0.0f, 1.0f) * 65535.0f)), i % 16 == 15 ? "\n" : "");
  }
}

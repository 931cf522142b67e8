// SPDX-License-Identifier: Apache-2.0
// The light tree on the host: built from the light table, refitted where lights moved (shared/light_tree.h says what it
// is, lib/light_tree.h how it is read).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/light_tree.h"
#include "shared/lights.h"

namespace hw {

struct LightTreeInput {
  std::span<const LightRecord> lights;
  std::span<const float> weights;  // flux estimates [W], one for each light; what is not above 0 is left out
  float scene_radius = 1;          // [m], as in LightTableInput
  int threads = 0;                 // 0: as many as the machine has
};

// 2 n - 1 nodes and 24 bytes for each of the n lights of positive weight: 72 bytes a light. No lights: no nodes.
struct LightTree {
  std::vector<LightTreeNode> nodes;
  std::vector<LightTreeBounds> leaves;  // of the light at each position
  LightTreeScale scale{};               // of the nodes' places
  float unit = 1;                    // intensity [W sr^-1] that a power of 1 stands for; distant: irradiance [W m^-2]
  std::vector<std::uint32_t> order;  // light at each position
  std::vector<std::uint32_t> position;  // of each light of the table; HW_NONE for those left out
  double looseness = 0;                 // area of boxes by the power in them, in the root's; grows as a refit tree ages
  double built_looseness = 0;           // as it was when the tree was built
};

// Top-down, in O(n log n), on all threads: splits by the surface area orientation heuristic (Conty Estevez and Kulla
// 2018) over bins along the three axes; lights at infinity apart from the others. The same bits for any number of
// threads. Throws std::length_error for 2^28 lights or more.
LightTree build_light_tree(const LightTreeInput& input);

// Takes bounds and power anew, in the same layout, in O(n). False where the tree should rather be built anew: other
// lights have weight, or boxes grew over one another (looseness 1.5 times what it was when built); it is then of no
// use.
bool refit_light_tree(LightTree& tree, const LightTreeInput& input);

}  // namespace hw

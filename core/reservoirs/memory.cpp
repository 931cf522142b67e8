// SPDX-License-Identifier: Apache-2.0
// Memory of the reservoirs of each integrator, as reservoirs/*.cpp allocate them: for panels and statistics.
#include <algorithm>
#include <bit>

#include "reservoirs/light_cells.h"
#include "reservoirs/record_cells.h"
#include "session/reuse_settings.h"
#include "shared/reuse.h"

namespace hw {

std::uint64_t reservoir_bytes(const std::string& integrator, const ReuseParams& p, std::uint32_t width,
                              std::uint32_t height) {
  constexpr std::uint64_t kCell = sizeof(ReuseCell) + 4;  // and its place in the list of touched cells
  constexpr std::uint64_t kRecord = 2 * sizeof(ReuseRecord) + sizeof(RecordCell) + 4;
  const std::uint64_t pixels = std::uint64_t(width) * height;
  if (integrator.starts_with("restir")) return pixels * 2 * (sizeof(Reservoir) + sizeof(ReuseSurface));
  if (integrator == "wssr-kd") {
    const std::uint64_t leaves =
        std::bit_ceil(std::max<std::uint64_t>((pixels + p.points_per_leaf - 1) / p.points_per_leaf, 1));
    if (p.unbiased) {
      const std::uint64_t slots = following_tree_capacity(leaves);
      return slots * (p.reservoirs_per_cell * (kRecord + sizeof(vec3)) + 2 * sizeof(FollowingNode) + 4);
    }
    return (leaves - 1) * 4 + leaves * p.reservoirs_per_cell * kCell;
  }
  if (integrator.starts_with("wssr-grid")) {
    const std::uint64_t n = p.grid_resolution;
    return n * n * n * p.reservoirs_per_cell * (p.unbiased ? kRecord : kCell);
  }
  if (integrator == "wssr-hash") return LightCells::bytes_used(std::uint64_t(p.reservoir_memory) << 20);
  return 0;
}

}  // namespace hw

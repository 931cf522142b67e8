// SPDX-License-Identifier: Apache-2.0
// Tangents of the meshes that were set since the last commit: large ones on all threads, small ones side by side.
// At the commit and not as each mesh is set: many come at once then, and nobody waits for a lock of Python's between.
#include "scene/scene_impl.h"
#include "scene/tangents.h"
#include "threads/parts.h"

namespace hw {
namespace {

constexpr std::size_t kLargeMesh = 50'000;  // triangles from which one mesh fills all threads

void make(MeshEntry& entry, int threads) {
  const MeshArrays& arrays = entry.arrays;
  const std::size_t given = entry.data.attributes.size() - entry.data.tangents.size();
  for (std::size_t i = 0; i < entry.data.tangents.size(); ++i) {
    const std::size_t map = entry.data.tangents[i].uv;
    const AttributeData& uv = entry.data.attributes[map];
    const TangentInput input{arrays.positions,
                             arrays.normals,
                             arrays.tri_vertices,
                             arrays.tri_corners,
                             entry.summary.corners_in_order,
                             arrays.attributes[map],
                             uv.components,
                             uv.domain == HW_DOMAIN_VERTEX,
                             entry.summary.corner_count};
    AttributeData& made = entry.data.attributes[given + i];
    made.data = corner_tangents(input, threads);
    entry.arrays.attributes[given + i] = made.data;
  }
}

}  // namespace

void Scene::Impl::make_tangents(int threads) {
  std::vector<MeshEntry*> small;
  for (Id id : pending.meshes_set) {
    MeshEntry& entry = meshes.at(id);
    if (entry.data.tangents.empty()) continue;
    if (entry.summary.triangle_count < kLargeMesh)
      small.push_back(&entry);
    else
      make(entry, threads);
  }
  in_turns(thread_count(threads), small.size(), [&](std::size_t i) { make(*small[i], 1); });
}

}  // namespace hw

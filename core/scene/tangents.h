// SPDX-License-Identifier: Apache-2.0
// Tangents of a UV map at the corners of triangles, as normal maps are baked for.
//
// After M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008): corners that agree in position, normal, UV
// and handedness share one tangent, the mean of their triangles' tangents in the plane of the normal, weighted by the
// angle at the corner. Corners that agree but do not hang together by edges share theirs too, which the reference keeps
// apart. Neither Debian 12 nor PyPI has the reference as a library that is kept (2026-11).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hw {

// Indices in range and finite numbers: what check_mesh() lets pass.
struct TangentInput {
  std::span<const float> positions, normals;  // 3 a vertex; 3 a corner or empty: flat
  std::span<const std::uint32_t> tri_vertices;
  std::span<const std::uint32_t> tri_corners;  // empty: as tri_vertices, or 0, 1, 2, ...
  bool corners_in_order = false;
  std::span<const float> uv;
  std::uint32_t uv_components = 2;  // 2 at least, of which the first two count
  bool uv_at_vertices = false;      // else at corners
  std::size_t corner_count = 0;
};

// 4 floats a corner: a unit vector in object space, or zero where the map or the triangle has no area, and the sign of
// the bitangent. A corner of several triangles that differ gets the last one's. The same for any number of threads
// (0: all).
std::vector<float> corner_tangents(const TangentInput& input, int threads);

}  // namespace hw

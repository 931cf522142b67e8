// SPDX-License-Identifier: Apache-2.0
// Checks at the scene's boundary. What passes them can be uploaded and traced without reading outside any table.
//
// Policy for bad numbers: geometry that is used for tracing (positions, matrices, cameras, lights) is refused when it
// holds NaN or infinity, since no picture of it would be right. Shading data that files often carry broken (normals,
// attributes) is repaired: a normal that is not finite or has no length becomes its triangle's geometric normal, an
// attribute value that is not finite becomes 0.
#pragma once

#include <cstddef>
#include <string>

#include "scene/scene.h"

namespace hw {

// `mesh "Cube" (id 7)`, for messages.
std::string scene_label(const char* kind, const std::string& name, Id id);

// What a mesh's arrays amount to, found while they are checked.
struct MeshSummary {
  std::uint32_t vertex_count = 0, triangle_count = 0, max_slot = 0;
  std::size_t corner_count = 0;
  bool corners_in_order = false;                    // triangle i has the corners 3i, 3i + 1, 3i + 2
  std::array<float, 3> min{0, 0, 0}, max{0, 0, 0};  // bounds of all vertices, object space; zero for none
};

// Each throws SceneError naming the object and the reason. Those that take a reference to mutable data may repair it.
// arrays: those of the mesh. What is repaired is copied into the mesh's own vectors first, where it was lent. Corners
// in order are forgotten: the summary says it all. Each of the tangents that it asks for gets an attribute without
// values.
MeshSummary check_mesh(Id id, MeshData& mesh, MeshArrays& arrays);
void check_instance(Id id, const InstanceData& instance, const float* matrices, std::size_t count);
void check_lights(std::span<const Id> ids, const LightData& light, const float* matrices);  // ids: one at least
void check_material(Id id, const MaterialData& material);
void check_image(Id id, const ImageData& image);
void check_world(const WorldData& world);
void check_camera(const CameraData& camera);

// The inverse of a row-major 3x4 matrix, computed in double. False when it is singular (`out` is then zero).
bool invert(const float* matrix, float* out);

// Whether all of `count` floats are finite.
bool all_finite(const float* values, std::size_t count);

// Bytes of one texel, 0 for an unknown format.
std::size_t texel_bytes(std::uint32_t format);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// What Tables keeps about each thing it has uploaded; for core/scene/tables*.cpp only.
#pragma once

#include "scene/scene_impl.h"
#include "scene/tables.h"

namespace hw {

// The mesh that stands for nothing in the Tracer. The scene does not take this id.
constexpr Id kNoMesh = ~Id{0};

struct Tables::MeshSlot {
  std::uint64_t revision = 0;      // of the scene's entry, 0: nothing uploaded
  std::uint32_t record = HW_NONE;  // index in the mesh table
  std::uint32_t vertex_count = 0;
  bool traced = false;   // the Tracer has it
  bool changed = false;  // uploaded by the update that is under way
  std::unique_ptr<Buffer> positions, arrays;
  std::size_t tri_vertices_at = 0;      // byte offset in `arrays`
  std::uint64_t topology = 0;           // topology_hash(), worked out where the mesh emits
  std::uint64_t topology_revision = 0;  // of the scene's entry when it was
  std::unique_ptr<Buffer> motion;       // last frame's positions
  std::uint64_t motion_frame = 0;       // commit count in which they were the last frame's
};

struct Tables::ImageSlot {
  std::uint64_t revision = 0;
  std::unique_ptr<Buffer> texels;
};

struct Tables::GroupSlot {
  Id first = 0;
  const InstanceGroup* group = nullptr;
  const MeshEntry* mesh = nullptr;
  const MeshSlot* mesh_slot = nullptr;
  std::uint32_t base = 0;  // first index in the instance table
  std::uint32_t slot_offset = 0, slot_count = 0;
  bool casts_transparent = false;     // some of its materials let light through
  std::uint32_t mask = 0;             // HW_MASK_* of an instance that can be hit
  std::uint32_t features = 0;         // HW_FEATURE_* that its materials need
  bool emitting_slots = false;        // some of its materials may emit
  bool varying = false;               // ... by a program
  bool emissive = false;              // some of them may, and it has triangles to emit from
  std::uint32_t light_triangles = 0;  // of one instance, as the light table was laid out
  bool written = false;               // by the update that is under way
  bool remeasured = false;            // its triangles are to take what was measured of their emission
  const MeasuredEmission* emission = nullptr;
  double low[3], high[3];  // world bounds of what can be hit; low > high for nothing
};

// Newest revision of a material's program and its images.
std::uint64_t program_revision(const Scene::Impl& scene, Id id);

// What instances without a material show: Root::materials[0].
MaterialData default_material();

// InstanceRecord::key of the instance with this id: a hash, never HW_NONE.
std::uint32_t object_key(Id id);

// An instance's matrix as it is traced and shaded, and its inverse. A matrix that flattens one axis (scale 0 in Z, say)
// is given a thickness of 1e-4 of its other scales along that axis: rays then meet the flattened object where it lies.
// One that flattens two axes or three has no picture: `visible` is false and `inverse` zero.
struct Placement {
  float matrix[12];
  float inverse[12];
  bool visible = true;
  bool mirrored = false;
};
Placement place(const Matrix34& object_to_world);

}  // namespace hw

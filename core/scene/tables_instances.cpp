// SPDX-License-Identifier: Apache-2.0
// The instance table: one record an instance, in the order of their ids, rewritten group by group.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "scene/tables_impl.h"

namespace hw {
namespace {

// Grows low..high by a box seen through a matrix: its centre and half extents, transformed.
void add_box(double* low, double* high, const float* m, const MeshSummary& box) {
  for (int r = 0; r < 3; ++r) {
    double centre = m[4 * r + 3], half = 0;
    for (int c = 0; c < 3; ++c) {
      centre += m[4 * r + c] * 0.5 * (double{box.min[c]} + box.max[c]);
      half += std::abs(m[4 * r + c]) * 0.5 * (double{box.max[c]} - box.min[c]);
    }
    low[r] = std::min(low[r], centre - half);
    high[r] = std::max(high[r], centre + half);
  }
}

}  // namespace

std::uint32_t object_key(Id id) {
  // The finaliser of MurmurHash3: neighbouring ids, and ids that differ in their upper half alone, part in every bit.
  std::uint64_t h = id;
  h = (h ^ h >> 33) * 0xff51afd7ed558ccdull;
  h = (h ^ h >> 33) * 0xc4ceb9fe1a85ec53ull;
  const auto key = static_cast<std::uint32_t>(h ^ h >> 33);
  return key == HW_NONE ? 0u : key;
}

Placement place(const Matrix34& object_to_world) {
  Placement out;
  const Matrix34& m = object_to_world;
  std::copy(m.begin(), m.end(), out.matrix);
  // Cofactors: for a matrix that flattens one axis they are s1 s2 n k^T, with n the world direction that it can't reach
  // and k the object direction that it loses.
  double cofactor[9], cofactor_norm = 0, norm = 0;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      const double value = double{m[4 * r1 + c1]} * m[4 * r2 + c2] - double{m[4 * r1 + c2]} * m[4 * r2 + c1];
      cofactor[3 * r + c] = value;
      cofactor_norm += value * value;
      norm += double{m[4 * r + c]} * m[4 * r + c];
    }
  cofactor_norm = std::sqrt(cofactor_norm);
  double determinant = 0;
  for (int c = 0; c < 3; ++c) determinant += m[c] * cofactor[c];
  out.mirrored = determinant < 0;
  // Singular values s1 >= s2 >= s3: cofactor_norm is about s1 s2, the determinant s1 s2 s3.
  out.visible = norm > 0 && cofactor_norm > 1e-12 * norm;
  if (out.visible) {
    const double scale = std::sqrt(cofactor_norm);
    if (std::abs(determinant) < 1e-6 * cofactor_norm * scale) {
      const double thickness = (out.mirrored ? -1e-4 : 1e-4) * scale / cofactor_norm;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          out.matrix[4 * r + c] = static_cast<float>(m[4 * r + c] + thickness * cofactor[3 * r + c]);
    }
    out.visible = invert(out.matrix, out.inverse);
  }
  if (!out.visible) {
    std::fill(out.inverse, out.inverse + 12, 0.0f);
    out.mirrored = false;
  }
  return out;
}

void Tables::lay_out_instances() {
  const Scene::Impl& scene = scene_.impl();
  groups_.clear();
  std::vector<std::uint32_t> slots;
  std::map<std::uint32_t, std::size_t> feature_sets;
  std::uint32_t base = 0;
  for (const auto& [id, group] : scene.groups) {
    GroupSlot slot;
    slot.first = id;
    slot.group = &group;
    slot.mesh = &scene.meshes.at(group.shared.mesh);
    slot.mesh_slot = &meshes_.at(group.shared.mesh);
    slot.base = base;
    base += static_cast<std::uint32_t>(group.matrices.size());
    // A slot for each that a triangle names: those past the object's last take its last material, as in Blender.
    slot.slot_offset = static_cast<std::uint32_t>(slots.size());
    std::uint32_t flags = 0;
    slot.features = 0;
    const std::size_t count =
        std::max<std::size_t>({group.shared.materials.size(), slot.mesh->summary.max_slot + std::size_t{1}});
    for (std::size_t i = 0; i < count; ++i) {
      const auto& ids = group.shared.materials;
      const Id material = ids.empty() ? 0 : ids[std::min(i, ids.size() - 1)];
      slots.push_back(material == 0 ? 0 : material_index_.at(material));
      const std::uint32_t of_slot = material_table_[slots.back()].flags;
      flags |= of_slot;
      constexpr std::uint32_t kVaries = HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMISSION_SHADER;
      slot.varying |= (of_slot & kVaries) == kVaries;
      slot.features |= material_features_[slots.back()];
    }
    feature_sets[slot.features] += group.matrices.size();
    slot.slot_count = static_cast<std::uint32_t>(count);
    slot.emitting_slots = flags & HW_MATERIAL_EMISSIVE;
    slot.casts_transparent = (flags & HW_MATERIAL_TRANSPARENT) != 0;
    groups_.emplace_hint(groups_.end(), id, slot);
  }
  totals_.classes = choose_shading_classes(feature_sets);
  instance_table_.resize(base);
  slot_table_.assign(slots);
  totals_.instances = base;
}

void Tables::write_group(GroupSlot& slot) {
  const InstanceGroup& group = *slot.group;
  slot.mask = group.shared.visibility & 0xffu & ~HW_MASK_LAMP;
  if (slot.casts_transparent && (slot.mask & HW_MASK_SHADOW_OPAQUE))
    slot.mask = (slot.mask & ~HW_MASK_SHADOW_OPAQUE) | HW_MASK_SHADOW_TRANSPARENT;
  const MeshSummary& box = slot.mesh->summary;
  InstanceRecord shared{};
  shared.mesh = slot.mesh_slot->record;
  shared.slot_offset = slot.slot_offset;
  shared.slot_count = slot.slot_count;
  shared.light_offset = HW_NONE;
  shared.object_index = group.shared.object_index;
  shared.color = vec3(group.shared.color[0], group.shared.color[1], group.shared.color[2]);
  shared.shadow_terminator_offset = group.shared.shadow_terminator_offset;
  // Blender's texture space: the bounding box, with an axis of no extent taken as one metre to each side.
  for (int a = 0; a < 3; ++a) {
    const float half = 0.5f * (box.max[a] - box.min[a]), centre = 0.5f * (box.max[a] + box.min[a]);
    const float extent = half > 0 ? half : 1.0f;
    shared.generated_min[a] = centre - extent;
    shared.generated_scale[a] = 0.5f / extent;
  }
  double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  InstanceRecord* records = instance_table_.edit(slot.base, group.matrices.size());
  for (std::size_t i = 0; i < group.matrices.size(); ++i) {
    InstanceRecord record = shared;
    const Placement placement = place(group.matrices[i]);
    const bool hittable = placement.visible && box.triangle_count > 0;
    std::copy(placement.matrix, placement.matrix + 12, record.object_to_world);
    std::copy(placement.inverse, placement.inverse + 12, record.world_to_object);
    // The last place is thickened like the present one where the matrix is flat: what stands still has no motion.
    const bool moved = !group.previous.empty() && group.previous[i] != group.matrices[i];
    const Placement last = moved ? place(group.previous[i]) : placement;
    std::copy(last.matrix, last.matrix + 12, record.previous_object_to_world);
    record.mask = hittable ? slot.mask : 0;
    record.key = object_key(slot.first + i);
    record.random_id = group.random_ids.empty() ? group.shared.random_id : group.random_ids[i];
    record.flags = group.shared.flags | (placement.mirrored ? HW_INSTANCE_MIRRORED : 0u) |
                   totals_.classes.class_of(slot.features) << HW_INSTANCE_CLASS_SHIFT;
    if (hittable) add_box(low, high, placement.matrix, box);
    records[i] = record;
  }
  std::copy(low, low + 3, slot.low);
  std::copy(high, high + 3, slot.high);
  if (slot.emissive) lights_dirty_ = true;
  slot.written = true;
  tracer_instances_dirty_ = true;
}

void Tables::update_instances(TableCounts& counts) {
  const Scene::Impl& scene = scene_.impl();
  for (auto& [id, slot] : groups_) slot.written = false;
  const bool layout = layout_dirty_ || seen_layout_ != scene.layout_revision;
  if (layout) {
    lay_out_instances();
    layout_dirty_ = false;
    seen_layout_ = scene.layout_revision;
    lights_layout_dirty_ = true;
    tracer_instances_dirty_ = true;  // even when none is left
  }
  totals_.triangles = 0;
  for (auto& [id, slot] : groups_) {
    totals_.triangles += slot.group->matrices.size() * slot.mesh->summary.triangle_count;
    if (!layout && slot.group->revision < seen_ && !slot.mesh_slot->changed) continue;
    const std::uint32_t light_triangles = slot.emitting_slots ? slot.mesh->summary.triangle_count : 0;
    if (light_triangles != slot.light_triangles) lights_layout_dirty_ = true;
    slot.light_triangles = light_triangles;
    slot.emissive = light_triangles > 0;
    write_group(slot);
    counts.instances_uploaded += slot.group->matrices.size();
  }
}

void Tables::feed_tracer_instances() {
  if (!tracer_instances_dirty_) return;
  std::vector<TraceInstance> instances;
  instances.reserve(instance_table_.size());
  for (const auto& [id, slot] : groups_) {
    const InstanceGroup& group = *slot.group;
    for (std::size_t i = 0; i < group.matrices.size(); ++i) {
      const InstanceRecord& record = instance_table_[slot.base + i];
      TraceInstance instance{};
      // What can't be hit still has its place in the array: an empty mesh stands for it, out of the way.
      if (record.mask == 0 && slot.mask != 0) {
        instance.object_to_world[0] = instance.object_to_world[5] = instance.object_to_world[10] = 1;
        instance.mesh = kNoMesh;
      } else {
        std::copy(record.object_to_world, record.object_to_world + 12, instance.object_to_world);
        instance.mesh = slot.mesh->summary.triangle_count > 0 ? group.shared.mesh : kNoMesh;
      }
      instance.mask = record.mask;
      instance.moves = group.shared.moves;
      instances.push_back(instance);
    }
  }
  if (std::any_of(instances.begin(), instances.end(), [](const TraceInstance& i) { return i.mesh == kNoMesh; }))
    set_no_mesh();
  tracer_.set_instances(instances);
  tracer_instances_dirty_ = false;
}

void Tables::set_no_mesh() {
  if (has_no_mesh_) return;
  static constexpr float kPositions[9 + 4] = {};  // one triangle without area, and the bytes Embree reads past it
  static constexpr std::uint32_t kIndices[3] = {0, 1, 2};
  tracer_.set_mesh(kNoMesh, {std::span(kPositions).first(9), kIndices, "nothing"});
  has_no_mesh_ = true;
}

}  // namespace hw

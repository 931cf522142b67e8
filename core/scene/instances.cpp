// SPDX-License-Identifier: Apache-2.0
// Groups of instances under ranges of ids: a million of them is one entry with three arrays.
#include <algorithm>
#include <cstring>

#include "scene/scene_impl.h"

namespace hw {
namespace {

bool same_shared(const InstanceData& a, const InstanceData& b) {
  return a.mesh == b.mesh && a.materials == b.materials && a.visibility == b.visibility &&
         a.object_index == b.object_index && a.random_id == b.random_id && a.flags == b.flags && a.color == b.color &&
         a.shadow_terminator_offset == b.shadow_terminator_offset && a.moves == b.moves && a.name == b.name;
}

}  // namespace

void Scene::Impl::use_materials(const std::vector<Id>& ids, std::ptrdiff_t sign) {
  for (Id id : ids)
    if (id != 0) materials.at(id).users += static_cast<std::size_t>(sign);
}

void Scene::Impl::use_group(const InstanceGroup& group, std::ptrdiff_t sign) {
  meshes.at(group.shared.mesh).users += static_cast<std::size_t>(sign) * group.matrices.size();
  use_materials(group.shared.materials, sign);
}

void Scene::Impl::touch_layout() {
  layout_revision = revision++;
  instances_other = true;
}

const InstanceGroup* Scene::Impl::find_group(Id id, Id* first) const {
  auto it = groups.upper_bound(id);
  if (it == groups.begin()) return nullptr;
  --it;
  if (id - it->first >= it->second.matrices.size()) return nullptr;
  if (first) *first = it->first;
  return &it->second;
}

InstanceGroup Scene::Impl::slice(const InstanceGroup& group, std::size_t begin, std::size_t end) const {
  InstanceGroup part;
  part.shared = group.shared;
  part.matrices.assign(group.matrices.begin() + begin, group.matrices.begin() + end);
  if (!group.previous.empty()) part.previous.assign(group.previous.begin() + begin, group.previous.begin() + end);
  if (!group.random_ids.empty())
    part.random_ids.assign(group.random_ids.begin() + begin, group.random_ids.begin() + end);
  part.revision = group.revision;
  part.placed_revision = group.placed_revision;
  part.shared_revision = group.shared_revision;
  part.moved_frame = group.moved_frame;
  part.created_frame = group.created_frame;
  return part;
}

// Makes `id` the start of a group where it lies inside one; returns the first group at or after `id`.
std::map<Id, InstanceGroup>::iterator Scene::Impl::split_at(Id id) {
  auto it = groups.upper_bound(id);
  if (it != groups.begin()) {
    auto before = std::prev(it);
    const std::size_t at = id - before->first;
    if (at == 0) return before;
    if (at < before->second.matrices.size()) {
      InstanceGroup tail = slice(before->second, at, before->second.matrices.size());
      before->second = slice(before->second, 0, at);
      use_materials(tail.shared.materials, 1);  // its mesh users were counted one by one
      touch_layout();
      return groups.emplace_hint(it, id, std::move(tail));
    }
  }
  return it;
}

void Scene::Impl::set_instances(Id first, const InstanceData& shared, const float* matrices,
                                const std::uint32_t* random_ids, std::size_t count) {
  const Matrix34* rows = reinterpret_cast<const Matrix34*>(matrices);
  InstanceData common = shared;
  common.object_to_world = Matrix34{};

  // The common case in an animation: the same range again. Only what differs is marked.
  if (auto it = groups.find(first); it != groups.end() && it->second.matrices.size() == count) {
    InstanceGroup& group = it->second;
    const std::vector<std::uint32_t> ids =
        random_ids ? std::vector<std::uint32_t>(random_ids, random_ids + count) : std::vector<std::uint32_t>{};
    const bool same = same_shared(group.shared, common) && group.random_ids == ids;
    const bool moved = std::memcmp(group.matrices.data(), matrices, count * sizeof(Matrix34)) != 0;
    if (moved) {
      if (group.created_frame != frame && (group.previous.empty() || group.moved_frame != frame)) {
        group.previous = std::move(group.matrices);
        group.moved_frame = frame;
        group.matrices.assign(rows, rows + count);
      } else {
        std::memcpy(group.matrices.data(), matrices, count * sizeof(Matrix34));
      }
      instances_moved = true;
      group.revision = group.placed_revision = revision++;
    }
    if (!same) {
      const bool relayout = group.shared.mesh != common.mesh || group.shared.materials != common.materials;
      use_group(group, -1);
      group.shared = std::move(common);
      group.random_ids = ids;
      use_group(group, 1);
      instances_other = true;
      group.revision = group.shared_revision = revision++;
      if (relayout) touch_layout();
    }
    return;
  }

  // Otherwise the range is cut out of what is there, and what was there gives the new instances their last places.
  InstanceGroup fresh;
  fresh.shared = std::move(common);
  fresh.matrices.assign(rows, rows + count);
  if (random_ids) fresh.random_ids.assign(random_ids, random_ids + count);
  auto begin = split_at(first);
  auto end = split_at(first + count);
  begin = groups.lower_bound(first);
  bool moved = false;
  fresh.created_frame = frame;
  for (auto it = begin; it != end; ++it) {
    if (it->second.created_frame == frame) continue;
    fresh.created_frame = it->second.created_frame;
    const std::size_t offset = it->first - first;
    const InstanceGroup& old = it->second;
    const bool in_frame = !old.previous.empty() && old.moved_frame == frame;
    const std::vector<Matrix34>& last = in_frame ? old.previous : old.matrices;
    if (std::memcmp(last.data(), fresh.matrices.data() + offset, last.size() * sizeof(Matrix34)) == 0) continue;
    if (!moved) fresh.previous = fresh.matrices;
    moved = true;
    std::copy(last.begin(), last.end(), fresh.previous.begin() + static_cast<std::ptrdiff_t>(offset));
  }
  fresh.moved_frame = frame;
  for (auto it = begin; it != end; it = groups.erase(it)) {
    use_group(it->second, -1);
    instance_count -= it->second.matrices.size();
  }
  fresh.revision = fresh.placed_revision = fresh.shared_revision = revision++;
  instance_count += count;
  use_group(fresh, 1);
  groups.emplace_hint(end, first, std::move(fresh));
  touch_layout();
}

void Scene::Impl::remove_instances(Id first, std::size_t count) {
  split_at(first);
  auto end = split_at(first + count);
  for (auto it = groups.lower_bound(first); it != end; it = groups.erase(it)) {
    use_group(it->second, -1);
    instance_count -= it->second.matrices.size();
  }
  touch_layout();
}

void Scene::Impl::settle_transforms() {
  for (auto& [id, group] : groups) {
    if (group.previous.empty() || group.moved_frame == frame) continue;
    std::vector<Matrix34>().swap(group.previous);
    group.revision = revision++;
    instances_moved = true;
  }
}

}  // namespace hw

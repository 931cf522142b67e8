// SPDX-License-Identifier: Apache-2.0
// Scene edits: check, take effect whole, remember what changed.
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "scene/scene_impl.h"

namespace hw {
namespace {

constexpr std::size_t kMaxInstances = 0x7fffffff;  // table indices and Vulkan's instance index stay below 2^31

template <class Map>
auto& require(Map& map, Id id, const char* kind) {
  auto it = map.find(id);
  if (it == map.end()) throw SceneError(std::string("no ") + kind + " has id " + std::to_string(id));
  return it->second;
}

void check_references(const Scene::Impl& scene, Id id, const InstanceData& instance) {
  const std::string label = scene_label("instance", instance.name, id);
  if (!scene.meshes.contains(instance.mesh))
    throw SceneError(label + ": no mesh has id " + std::to_string(instance.mesh));
  for (Id material : instance.materials)
    if (material != 0 && !scene.materials.contains(material))
      throw SceneError(label + ": no material has id " + std::to_string(material));
}

// Makes the picture plane of `from` the previous one of `to`.
void copy_plane(CameraData& to, const CameraData& from) {
  to.previous_left = from.left, to.previous_right = from.right;
  to.previous_bottom = from.bottom, to.previous_top = from.top;
}

void erase_id(std::vector<Id>& ids, Id id) { ids.erase(std::remove(ids.begin(), ids.end(), id), ids.end()); }

}  // namespace

std::uint32_t attribute_hash(const std::string& name) {
  std::uint32_t hash = 2166136261u;
  for (unsigned char c : name) hash = (hash ^ c) * 16777619u;
  return hash == 0 ? 1u : hash;
}

MeshArrays mesh_views(const MeshData& data) {
  MeshArrays arrays{data.positions, data.normals, data.tri_vertices, data.tri_corners, data.tri_slots, {}};
  arrays.attributes.reserve(data.attributes.size());
  for (const AttributeData& attribute : data.attributes) arrays.attributes.emplace_back(attribute.data);
  return arrays;
}

bool invert(const float* matrix, float* out) {
  double m[12], inverse[9];
  std::copy(matrix, matrix + 12, m);
  const auto minor = [&](int r0, int r1, int c0, int c1) {
    return m[4 * r0 + c0] * m[4 * r1 + c1] - m[4 * r0 + c1] * m[4 * r1 + c0];
  };
  inverse[0] = minor(1, 2, 1, 2), inverse[1] = -minor(0, 2, 1, 2), inverse[2] = minor(0, 1, 1, 2);
  inverse[3] = -minor(1, 2, 0, 2), inverse[4] = minor(0, 2, 0, 2), inverse[5] = -minor(0, 1, 0, 2);
  inverse[6] = minor(1, 2, 0, 1), inverse[7] = -minor(0, 2, 0, 1), inverse[8] = minor(0, 1, 0, 1);
  const double determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
  std::fill(out, out + 12, 0.0f);
  if (determinant == 0 || !std::isfinite(determinant)) return false;
  for (int r = 0; r < 3; ++r) {
    double translation = 0;
    for (int c = 0; c < 3; ++c) {
      const double value = inverse[3 * r + c] / determinant;
      out[4 * r + c] = static_cast<float>(value);
      translation -= value * m[4 * c + 3];
    }
    out[4 * r + 3] = static_cast<float>(translation);
  }
  if (all_finite(out, 12)) return true;
  std::fill(out, out + 12, 0.0f);
  return false;
}

Scene::Scene() : impl_(std::make_unique<Impl>()) {}
Scene::~Scene() = default;

void Scene::upsert_mesh(Id id, MeshData mesh) {
  MeshArrays arrays = mesh.keeper ? std::move(mesh.lent) : mesh_views(mesh);
  const MeshSummary summary = check_mesh(id, mesh, arrays);
  Impl& scene = *impl_;
  MeshEntry& entry = scene.meshes[id];
  // More slots than before, or other bounds, change the records of its instances.
  if (entry.users > 0 && entry.summary.max_slot != summary.max_slot) scene.touch_layout();
  if (entry.data.keeper) scene.done_keepers.push_back(std::move(entry.data.keeper));
  entry.data = std::move(mesh);  // the vectors' elements stay where they are
  entry.arrays = std::move(arrays);
  entry.summary = summary;
  entry.lender = nullptr;
  entry.revision = scene.revision++;
  entry.set_frame = scene.frame;
  erase_id(scene.pending.meshes_removed, id);
  erase_id(scene.pending.meshes_set, id);
  scene.pending.meshes_set.push_back(id);
}

std::vector<std::shared_ptr<const void>> Scene::take_done_keepers() { return std::exchange(impl_->done_keepers, {}); }

void Scene::keep_lent() {
  const auto copy = [](auto& to, const auto& from) {
    if (from.data() != to.data()) to.assign(from.begin(), from.end());  // what was repaired is a copy already
  };
  for (auto& [id, entry] : impl_->meshes) {
    if (!entry.data.keeper) continue;
    MeshData& data = entry.data;
    copy(data.positions, entry.arrays.positions), copy(data.normals, entry.arrays.normals);
    copy(data.tri_vertices, entry.arrays.tri_vertices), copy(data.tri_corners, entry.arrays.tri_corners);
    copy(data.tri_slots, entry.arrays.tri_slots);
    for (std::size_t i = 0; i < data.attributes.size(); ++i) copy(data.attributes[i].data, entry.arrays.attributes[i]);
    entry.arrays = mesh_views(data);
    entry.revision = impl_->revision++;  // a Tracer may have been given the arrays
    impl_->done_keepers.push_back(std::move(data.keeper));
  }
}

void Scene::upsert_instance(Id id, InstanceData instance) {
  const Matrix34 matrix = instance.object_to_world;
  upsert_instances(id, instance, matrix.data(), nullptr, 1);
}

void Scene::upsert_instances(Id first_id, const InstanceData& shared, const float* matrices,
                             const std::uint32_t* random_ids, std::size_t count) {
  if (count == 0) return;
  check_instance(first_id, shared, matrices, count);
  check_references(*impl_, first_id, shared);
  if (first_id > std::numeric_limits<Id>::max() - count)
    throw SceneError(scene_label("instance", shared.name, first_id) + ": the range of ids passes the largest id");
  if (count > kMaxInstances || impl_->instance_count > kMaxInstances - count)
    throw SceneError(scene_label("instance", shared.name, first_id) + ": a scene holds at most 2^31 - 1 instances");
  impl_->set_instances(first_id, shared, matrices, random_ids, count);
}

void Scene::upsert_light(Id id, LightData light) {
  const Matrix34 matrix = light.object_to_world;
  upsert_lights({&id, 1}, light, matrix.data());
}

void Scene::upsert_lights(std::span<const Id> ids, const LightData& shared, const float* matrices) {
  if (ids.empty()) return;
  check_lights(ids, shared, matrices);
  Impl& scene = *impl_;
  scene.lights_revision = scene.revision++;
  scene.pending.lights = true;
  auto next = scene.lights.end();  // ids in rising order take no search
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto it = scene.lights.insert_or_assign(next, ids[i], LightEntry{shared, scene.lights_revision});
    std::copy_n(matrices + 12 * i, 12, it->second.data.object_to_world.begin());
    next = std::next(it);
  }
}

void Scene::upsert_material(Id id, MaterialData material) {
  check_material(id, material);
  Impl& scene = *impl_;
  for (Id image : material.images)
    if (image != 0 && !scene.images.contains(image))
      throw SceneError(scene_label("material", material.name, id) + ": no image has id " + std::to_string(image));
  MaterialEntry& entry = scene.materials[id];
  for (Id image : entry.data.images)
    if (image != 0) --scene.images.at(image).users;
  for (Id image : material.images)
    if (image != 0) ++scene.images.at(image).users;
  entry.data = std::move(material);
  entry.revision = scene.materials_revision = scene.revision++;
  scene.pending.materials = true;
}

void Scene::upsert_image(Id id, ImageData image) {
  check_image(id, image);
  ImageEntry& entry = impl_->images[id];
  entry.data = std::move(image);
  entry.texels = entry.data.keeper ? entry.data.lent : entry.data.texels;
  entry.lender = nullptr;
  entry.revision = impl_->images_revision = impl_->revision++;
  impl_->pending.images = true;
}

void Scene::set_world(WorldData world) {
  check_world(world);
  Impl& scene = *impl_;
  if (world.material != 0 && !scene.materials.contains(world.material))
    throw SceneError("world \"" + world.name + "\": no material has id " + std::to_string(world.material));
  scene.use_materials({scene.world.material}, -1);
  scene.world = std::move(world);
  scene.use_materials({scene.world.material}, 1);
  scene.world_revision = scene.revision++;
  scene.pending.world = true;
}

void Scene::set_camera(const CameraData& camera) {
  check_camera(camera);
  Impl& scene = *impl_;
  CameraData next = camera;
  if (!scene.has_camera) {
    invert(next.camera_to_world, next.previous_world_to_camera);
    copy_plane(next, next);
  } else if (scene.camera_frame == scene.frame) {  // set twice in one frame: the last frame's stays the previous one
    std::memcpy(next.previous_world_to_camera, scene.camera.previous_world_to_camera,
                sizeof(next.previous_world_to_camera));
    next.previous_left = scene.camera.previous_left, next.previous_right = scene.camera.previous_right;
    next.previous_bottom = scene.camera.previous_bottom, next.previous_top = scene.camera.previous_top;
  } else {
    invert(scene.camera.camera_to_world, next.previous_world_to_camera);
    copy_plane(next, scene.camera);
  }
  scene.camera = next;
  scene.has_camera = true;
  scene.camera_frame = scene.frame;
  scene.camera_revision = scene.revision++;
  scene.pending.camera = true;
}

void Scene::remove_mesh(Id id) {
  Impl& scene = *impl_;
  MeshEntry& entry = require(scene.meshes, id, "mesh");
  if (entry.users > 0) {
    std::string user;
    for (const auto& [first, group] : scene.groups)
      if (group.shared.mesh == id) {
        user = scene_label("instance", group.shared.name, first);
        break;
      }
    throw SceneError(scene_label("mesh", entry.data.name, id) + " is used by " + user +
                     (entry.users > 1 ? " and others" : ""));
  }
  scene.meshes.erase(id);
  ++scene.revision;
  erase_id(scene.pending.meshes_set, id);
  scene.pending.meshes_removed.push_back(id);
}

void Scene::remove_instance(Id id) { remove_instances(id, 1); }

void Scene::remove_instances(Id first_id, std::size_t count) {
  for (std::size_t done = 0; done < count;) {
    Id first = 0;
    const InstanceGroup* group = impl_->find_group(first_id + done, &first);
    if (!group) throw SceneError("no instance has id " + std::to_string(first_id + done));
    done += group->matrices.size() - (first_id + done - first);
  }
  if (count > 0) impl_->remove_instances(first_id, count);
}

void Scene::remove_light(Id id) { remove_lights({&id, 1}); }

void Scene::remove_lights(std::span<const Id> ids) {
  for (Id id : ids) require(impl_->lights, id, "light");
  if (ids.empty()) return;
  for (Id id : ids) impl_->lights.erase(id);
  impl_->lights_revision = impl_->revision++;
  impl_->pending.lights = true;
}

void Scene::remove_material(Id id) {
  Impl& scene = *impl_;
  MaterialEntry& entry = require(scene.materials, id, "material");
  if (entry.users > 0) {
    std::string user = "the world";
    for (const auto& [first, group] : scene.groups)
      if (std::find(group.shared.materials.begin(), group.shared.materials.end(), id) != group.shared.materials.end()) {
        user = scene_label("instance", group.shared.name, first);
        break;
      }
    throw SceneError(scene_label("material", entry.data.name, id) + " is used by " + user);
  }
  for (Id image : entry.data.images)
    if (image != 0) --scene.images.at(image).users;
  scene.materials.erase(id);
  scene.materials_revision = scene.revision++;
  scene.pending.materials = true;
}

void Scene::remove_image(Id id) {
  Impl& scene = *impl_;
  ImageEntry& entry = require(scene.images, id, "image");
  if (entry.users > 0) {
    std::string user;
    for (const auto& [key, material] : scene.materials)
      if (std::find(material.data.images.begin(), material.data.images.end(), id) != material.data.images.end()) {
        user = scene_label("material", material.data.name, key);
        break;
      }
    throw SceneError(scene_label("image", entry.data.name, id) + " is used by " + user);
  }
  scene.images.erase(id);
  scene.images_revision = scene.revision++;
  scene.pending.images = true;
}

bool Scene::has_mesh(Id id) const { return impl_->meshes.contains(id); }

Changes Scene::commit(int threads) {
  Impl& scene = *impl_;
  scene.make_tangents(threads);  // the one part that may throw
  scene.settle_transforms();
  if (scene.has_camera && scene.camera_frame != scene.frame) {
    CameraData still = scene.camera;
    invert(still.camera_to_world, still.previous_world_to_camera);
    copy_plane(still, still);
    if (std::memcmp(&still, &scene.camera, sizeof(still)) != 0) {
      scene.camera = still;
      scene.camera_revision = scene.revision++;
      scene.pending.camera = true;
    }
  }
  Changes changes = std::move(scene.pending);
  changes.instances = scene.instances_moved || scene.instances_other;
  changes.transforms_only = scene.instances_moved && !scene.instances_other;
  scene.pending = Changes{};
  scene.instances_moved = scene.instances_other = false;
  ++scene.frame;
  return changes;
}

void Scene::clear() {
  Impl& scene = *impl_;
  // Counters go on, so that readers see everything as changed.
  Impl fresh;
  fresh.revision = scene.revision + 1;
  fresh.frame = scene.frame;
  fresh.layout_revision = fresh.lights_revision = fresh.materials_revision = fresh.images_revision =
      fresh.world_revision = fresh.camera_revision = scene.revision;
  for (const auto& [id, mesh] : scene.meshes) fresh.pending.meshes_removed.push_back(id);
  fresh.pending.lights = fresh.pending.materials = fresh.pending.images = fresh.pending.camera = fresh.pending.world =
      true;
  fresh.instances_other = true;
  scene = std::move(fresh);
}

}  // namespace hw

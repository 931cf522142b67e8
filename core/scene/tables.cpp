// SPDX-License-Identifier: Apache-2.0
// Order of an update: meshes and images, materials (they name images), instances (they name meshes and materials),
// lights (they need all of these), the Tracer's build, the root.
#include "scene/tables.h"

#include <chrono>
#include <cstring>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "scene/tables_impl.h"

namespace hw {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Tables::Tables(Device& device, Scene& scene, Tracer& tracer)
    : device_(device),
      scene_(scene),
      tracer_(tracer),
      lights_(std::make_unique<LightState>()),
      mesh_table_(device, "meshes"),
      instance_table_(device, "instances"),
      slot_table_(device, "slot materials"),
      material_table_(device, "materials"),
      program_table_(device, "material programs"),
      constant_table_(device, "material constants"),
      image_table_(device, "images"),
      light_table_(device, "lights"),
      alias_table_(device, "light alias table"),
      light_tree_table_(device, "light tree"),
      light_leaf_table_(device, "light tree leaves"),
      light_order_table_(device, "light tree order"),
      light_position_table_(device, "light tree positions"),
      world_table_(device, "world distribution"),
      emission_map_table_(device, "emission maps"),
      root_buffer_(std::make_unique<Buffer>(device, sizeof(Root), BufferUse::device, "root")) {
  root_.world_light = root_.world_material = HW_NONE;
  root_.window = device.window_begin();
}

Tables::~Tables() {
  // The Tracer may outlive these buffers: leave nothing of them in it.
  try {
    if (tracer_.owner == this) {
      leave_tracer();
      tracer_.commit();
    }
  } catch (...) {  // a lost device: the Tracer is of no more use, and neither is what it holds
    tracer_.owner = nullptr;
    tracer_.evict_owner = nullptr;
  }
  give_back(keep_scene_);
}

TableCounts Tables::update() {
  TableCounts counts;
  const auto start = std::chrono::steady_clock::now();
  const double built_before = tracer_.stats().build_seconds;
  Uploader uploader(device_);
  if (failed_ || seen_ == 0) {
    seen_ = seen_layout_ = seen_lights_ = seen_materials_ = seen_images_ = 0;
    layout_dirty_ = lights_layout_dirty_ = tracer_instances_dirty_ = true;
  }
  failed_ = true;
  take_tracer();
  update_meshes(uploader, counts);
  update_images(uploader, counts);
  update_materials(counts);
  update_instances(counts);
  feed_tracer_instances();
  counts.bytes_uploaded += mesh_table_.flush(uploader) + slot_table_.flush(uploader) + material_table_.flush(uploader) +
                           program_table_.flush(uploader) + constant_table_.flush(uploader) +
                           image_table_.flush(uploader);
  update_lights(uploader, counts);
  uploader.flush();
  tracer_.commit();
  counts.bytes_uploaded += array_bytes_;
  array_bytes_ = 0;
  seen_ = scene_.impl().revision;
  failed_ = false;
  root_dirty_ = true;
  update_root();
  untrimmed_ = untrimmed_ || counts.meshes_uploaded + counts.images_uploaded > 0;
  counts.build_seconds = tracer_.stats().build_seconds - built_before;
  counts.upload_seconds = std::max(0.0, seconds_since(start) - counts.build_seconds - counts.lights_seconds);
  return counts;
}

void Tables::trim_heap() {
#if defined(__GLIBC__)
  if (untrimmed_) malloc_trim(0);
#endif
  untrimmed_ = false;
}

void Tables::update_root() {
  const Scene::Impl& scene = scene_.impl();
  const LightState& state = *lights_;
  Root next = root_;
  next.meshes = mesh_table_.address();
  next.instances = instance_table_.address();
  next.slot_materials = slot_table_.address();
  next.materials = material_table_.address();
  next.programs = program_table_.address();
  next.constants = constant_table_.address();
  next.images = image_table_.address();
  next.lights = light_table_.address();
  next.light_alias = alias_table_.address();
  next.light_tree = light_tree_table_.address();
  next.light_leaves = light_leaf_table_.address();
  next.light_order = light_order_table_.address();
  next.light_position = light_position_table_.address();
  next.light_tree_scale = state.tree.scale;
  next.emission_maps = emission_map_table_.address();
  next.light_tree_nodes = state.tree_current ? static_cast<uint>(light_tree_table_.size()) : 0u;
  next.world = state.distribution.record;
  next.world.marginal = world_table_.address();
  next.world.conditional = world_table_.address() + state.distribution.marginal.size() * sizeof(float);
  next.camera = scene.camera;
  next.mesh_count = static_cast<uint>(mesh_table_.size());
  next.instance_count = static_cast<uint>(instance_table_.size());
  next.material_count = static_cast<uint>(material_table_.size());
  next.image_count = static_cast<uint>(image_table_.size());
  // No light can be chosen: the table must not be sampled.
  next.light_count = state.table.total_weight > 0 ? static_cast<uint>(state.table.lights.size()) : 0u;
  next.lamp_count = state.table.lamp_count;
  next.world_light = state.table.world_light;
  next.world_material = state.world.material;
  next.world_color = vec3(scene.world.color[0], scene.world.color[1], scene.world.color[2]);
  next.sun_offset = state.table.sun_offset;
  next.sun_count = state.table.sun_count;
  next.world_flags = scene.world.flags;
  root_ = next;
  root_dirty_ = true;
  totals_.lamps = state.table.lamp_count;
  totals_.lights = state.table.lights.size();
}

const Buffer& Tables::root_buffer() {
  if (root_dirty_) device_.write(*root_buffer_, 0, std::as_bytes(std::span(&root_, 1)));
  root_dirty_ = false;
  return *root_buffer_;
}

}  // namespace hw

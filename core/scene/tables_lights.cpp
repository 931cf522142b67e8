// SPDX-License-Identifier: Apache-2.0
// Lights on the device: gathers lamps, emissive instances and the world for core/lights, and uploads what it makes of
// them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "scene/tables_impl.h"

namespace hw {
namespace {

// Cells of the importance map across: for a world without images, and at most for one with. Finer maps cost more to
// measure than they save in noise.
constexpr std::uint32_t kDefaultWorldWidth = 512, kLargestAutomaticWidth = 2048;

float luminance(const std::array<float, 3>& c) { return 0.2126729f * c[0] + 0.7151522f * c[1] + 0.0721750f * c[2]; }

std::uint32_t light_flags(std::uint32_t visibility) {
  return (visibility & HW_MASK_CAMERA ? HW_LIGHT_CAMERA : 0u) | (visibility & HW_MASK_DIFFUSE ? HW_LIGHT_DIFFUSE : 0u) |
         (visibility & HW_MASK_GLOSSY ? HW_LIGHT_GLOSSY : 0u) |
         (visibility & HW_MASK_TRANSMISSION ? HW_LIGHT_TRANSMISSION : 0u);
}

// The largest image of the world's material decides how fine its importance map is, as in Cycles.
Tables::GridSize importance_size(const Scene::Impl& scene) {
  std::uint32_t width = scene.world.importance_width;
  if (width == 0) {
    for (Id id : scene.materials.at(scene.world.material).data.images)
      if (id != 0) width = std::max({width, scene.images.at(id).data.width, 2 * scene.images.at(id).data.height});
    width = width == 0 ? kDefaultWorldWidth : std::min(width, kLargestAutomaticWidth);
  }
  width = std::max(width, 4u);
  return {width, width / 2};
}

// Newest revision of what the world's luminance depends on.
std::uint64_t world_revision(const Scene::Impl& scene) {
  std::uint64_t revision = scene.world_revision;
  if (scene.world.material == 0) return revision;
  const MaterialEntry& material = scene.materials.at(scene.world.material);
  revision = std::max(revision, material.revision);
  for (Id id : material.data.images)
    if (id != 0) revision = std::max(revision, scene.images.at(id).revision);
  return revision;
}

}  // namespace

void Tables::gather_lamps() {
  LightState& state = *lights_;
  std::vector<std::pair<Id, std::uint32_t>> kinds;
  state.lamps.clear();
  for (const auto& [id, light] : scene_.impl().lights) {
    kinds.emplace_back(id, light.data.type);
    state.lamps.push_back(light.data);
  }
  if (kinds != state.lamp_kinds) lights_layout_dirty_ = true;  // places in the table change
  state.lamp_kinds = std::move(kinds);
}

void Tables::gather_world() {
  LightState& state = *lights_;
  const Scene::Impl& scene = scene_.impl();
  const std::uint64_t revision = world_revision(scene);
  if (revision != state.world_revision) {
    state.world_revision = revision;
    state.wanted.reset();
    const bool constant = scene.world.material == 0;
    const float brightness = constant ? luminance(scene.world.color) : 1.0f;
    if (constant) {
      state.distribution = build_world_distribution(&brightness, 1, 1);  // uniform over the sphere
    } else {
      state.distribution = WorldTables{};  // nothing to sample until set_world_luminance()
      if (scene.world.sample) state.wanted = importance_size(scene);
    }
    state.world_changed = true;
    // A constant world is left to BSDF sampling, as in Cycles: it has no direction worth preferring, and every light
    // sample spent on it is one less for the lamps.
    const bool emits = scene.world.sample && !constant;
    if (emits != state.world.emits) lights_layout_dirty_ = true;
    state.world.emits = emits;
    state.world.mean_radiance = constant ? scene.world.color : std::array<float, 3>{1, 1, 1};
    lights_dirty_ = true;
  }
  const std::uint32_t material = scene.world.material == 0 ? HW_NONE : material_index_.at(scene.world.material);
  lights_dirty_ |= material != state.world.material;
  state.world.material = material;
  state.world.flags = scene.world.flags;
}

void Tables::gather_instances(std::vector<EmissiveInstance>& instances, std::vector<std::uint32_t>& moved) const {
  const std::span<const std::uint32_t> slots(slot_table_.data(), slot_table_.size());
  for (const auto& [id, slot] : groups_) {
    if (!slot.emissive) continue;
    EmissiveInstance instance;
    instance.name = slot.group->shared.name;
    const MeshArrays& mesh = slot.mesh->arrays;
    instance.positions = mesh.positions;
    instance.tri_vertices = mesh.tri_vertices;
    instance.tri_slots = mesh.tri_slots;
    instance.slot_materials = slots.subspan(slot.slot_offset, slot.slot_count);
    instance.flags = light_flags(slot.group->shared.visibility);
    for (std::size_t i = 0; i < slot.group->matrices.size(); ++i) {
      if (slot.written) moved.push_back(static_cast<std::uint32_t>(instances.size()));
      instance.instance = slot.base + static_cast<std::uint32_t>(i);
      const float* matrix = instance_table_[instance.instance].object_to_world;
      std::copy(matrix, matrix + 12, instance.object_to_world.begin());
      instances.push_back(instance);
    }
  }
}

float Tables::scene_radius() const {
  double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, square = 0;
  for (const auto& [id, slot] : groups_)
    for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], slot.low[a]), high[a] = std::max(high[a], slot.high[a]);
  for (int a = 0; a < 3; ++a)
    if (high[a] > low[a]) square += 0.25 * (high[a] - low[a]) * (high[a] - low[a]);
  const double radius = std::sqrt(square);
  return radius > 0 && radius < 1e18 ? static_cast<float>(radius) : 1.0f;
}

void Tables::update_lights(Uploader& uploader, TableCounts& counts) {
  const auto start = std::chrono::steady_clock::now();
  LightState& state = *lights_;
  const Scene::Impl& scene = scene_.impl();
  if (seen_lights_ != scene.lights_revision) {
    gather_lamps();
    lights_dirty_ = true;
  }
  gather_world();
  const float radius = scene_radius();
  if (radius != state.input_radius && (!state.lamps.empty() || state.world.emits)) lights_dirty_ = true;
  state.input_radius = radius;
  if (lights_dirty_ || lights_layout_dirty_) {
    std::vector<EmissiveInstance> instances;
    std::vector<std::uint32_t> moved;
    gather_instances(instances, moved);
    LightTableInput input;
    input.lamps = state.lamps;
    input.instances = instances;
    input.materials = {material_table_.data(), material_table_.size()};
    input.world = state.world;
    input.scene_radius = radius;
    input.selection = state.selection;
    std::size_t count = state.table.lamp_count + std::size_t{state.table.world_light != HW_NONE};
    if (lights_layout_dirty_) {
      state.table = build_light_table(input);
      count = state.table.lights.size();
    } else {
      update_light_table(state.table, input, moved);
      if (!moved.empty()) count = state.table.lights.size();
    }
    light_table_.resize(state.table.lights.size());
    if (count > 0) std::copy_n(state.table.lights.begin(), count, light_table_.edit(0, count));
    alias_table_.assign(state.table.alias);
    counts.lights_uploaded += count;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      const std::uint32_t at = instances[i].instance;
      if (instance_table_[at].light_offset != state.table.instance_offset[i])
        instance_table_.edit(at, 1)->light_offset = state.table.instance_offset[i];
    }
    tracer_.set_lamps(state.table.shapes);
    lights_dirty_ = lights_layout_dirty_ = false;
    seen_lights_ = scene.lights_revision;
  }
  if (state.world_changed) {
    const WorldTables& world = state.distribution;
    world_table_.resize(world.marginal.size() + world.conditional.size());
    if (world_table_.size() > 0) {
      float* to = world_table_.edit(0, world_table_.size());
      std::copy(world.conditional.begin(), world.conditional.end(),
                std::copy(world.marginal.begin(), world.marginal.end(), to));
    }
    state.world_changed = false;
  }
  counts.bytes_uploaded += light_table_.flush(uploader) + alias_table_.flush(uploader) + world_table_.flush(uploader) +
                           instance_table_.flush(uploader);
  counts.lights_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::optional<Tables::GridSize> Tables::world_luminance_wanted() const { return lights_->wanted; }

void Tables::set_world_luminance(std::span<const float> values, std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0 || values.size() != std::size_t{width} * height)
    throw std::invalid_argument("the world's luminance has " + std::to_string(values.size()) +
                                " values for a grid of " + std::to_string(width) + " x " + std::to_string(height));
  LightState& state = *lights_;
  state.distribution = build_world_distribution(values.data(), width, height);
  const float mean = state.distribution.mean;
  state.world.mean_radiance = {mean, mean, mean};
  state.world_changed = true;
  state.wanted.reset();
  lights_dirty_ = true;
  relight();
}

void Tables::choose_lights(const std::string& name) {
  if (name != "uniform" && name != "power")
    throw std::invalid_argument("unknown way to choose lights: \"" + name + "\" (known: uniform, power)");
  const LightSelection selection = name == "uniform" ? LightSelection::kUniform : LightSelection::kPower;
  if (selection == lights_->selection) return;
  lights_->selection = selection;
  lights_layout_dirty_ = true;
  relight();
}

// Lights alone, between updates.
void Tables::relight() {
  if (failed_ || seen_ == 0) return;  // the next update does it
  for (auto& [id, slot] : groups_) slot.written = false;
  Uploader uploader(device_);
  TableCounts counts;
  update_lights(uploader, counts);
  tracer_.commit();
  update_root();
  uploader.flush();
}

}  // namespace hw

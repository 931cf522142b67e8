// SPDX-License-Identifier: Apache-2.0
// Lights on the device: gathers lamps, emissive instances and the world for core/lights, and uploads what it makes of
// them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

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
  if (scene.world.material == 0) return scene.world_revision;
  return std::max(scene.world_revision, program_revision(scene, scene.world.material));
}

}  // namespace

std::uint64_t program_revision(const Scene::Impl& scene, Id id) {
  const MaterialEntry& material = scene.materials.at(id);
  std::uint64_t revision = material.revision;
  for (Id image : material.data.images)
    if (image != 0) revision = std::max(revision, scene.images.at(image).revision);
  return revision;
}

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
    if (slot.emission && slot.emission->radiance.size() == slot.light_triangles) {
      instance.radiance = slot.emission->radiance;
      instance.maps = slot.emission->map;
      instance.maps_at = slot.emission->maps_at;
    }
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
  const bool dirty = lights_dirty_ || lights_layout_dirty_;
  std::vector<EmissiveInstance> instances;
  std::vector<std::uint32_t> moved;
  const bool look = dirty || state.noted_images != scene.images_revision;
  if (look) {
    match_emission();
    for (auto& [id, slot] : groups_) slot.written |= std::exchange(slot.remeasured, false);
    gather_instances(instances, moved);
  }
  if (dirty) {
    LightTableInput input;
    input.lamps = state.lamps;
    input.instances = instances;
    input.materials = {material_table_.data(), material_table_.size()};
    input.world = state.world;
    input.scene_radius = radius;
    input.selection = state.selection;
    std::size_t count = state.table.lamp_count + std::size_t{state.table.world_light != HW_NONE};
    if (lights_layout_dirty_) {
      state.table = build_light_table(input, [this](std::size_t wanted) {
        light_table_.resize(wanted);
        return light_table_.edit(0, wanted);
      });
      count = state.table.lights.size();
    } else {
      update_light_table(state.table, input, moved);
      if (!moved.empty()) count = state.table.lights.size();
      light_table_.edit(0, count);  // that is where it wrote
    }
    alias_table_.assign(state.table.alias);
    counts.lights_uploaded += count;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      const std::uint32_t at = instances[i].instance;
      if (instance_table_[at].light_offset != state.table.instance_offset[i])
        instance_table_.edit(at, 1)->light_offset = state.table.instance_offset[i];
    }
    tracer_.set_lamps(state.table.shapes);
    update_light_tree(lights_layout_dirty_);
  }
  // Images change what programs emit, and nothing in the table.
  if (look) {
    note_lights(instances, lights_layout_dirty_);
    want_emission();
  }
  if (dirty) {
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
                           instance_table_.flush(uploader) + light_tree_table_.flush(uploader) +
                           light_leaf_table_.flush(uploader) + light_order_table_.flush(uploader) +
                           light_position_table_.flush(uploader) + emission_map_table_.flush(uploader);
  counts.lights_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// `rebuilt`: the light table was built anew.
void Tables::update_light_tree(bool rebuilt) {
  LightState& state = *lights_;
  if (!state.wants_tree) {
    state.tree_current = false;
    return;
  }
  LightTreeInput input;
  input.lights = state.table.lights;
  input.weights = state.table.weights;
  input.scene_radius = state.input_radius;
  // Nodes lie in their table alone between updates.
  const bool refit = !rebuilt && state.tree_current;
  if (refit) state.tree.nodes.assign(light_tree_table_.data(), light_tree_table_.data() + light_tree_table_.size());
  if (!refit || !refit_light_tree(state.tree, input)) {
    state.tree = build_light_tree(input);
    ++state.tree_revision;
    light_order_table_.assign(state.tree.order);
    light_position_table_.assign(state.tree.position);
  }
  ++state.tree_fit;
  light_tree_table_.assign(state.tree.nodes);
  light_leaf_table_.assign(state.tree.leaves);
  std::vector<LightTreeNode>().swap(state.tree.nodes);
  std::vector<LightTreeBounds>().swap(state.tree.leaves);
  state.tree_current = true;
}

// `rebuilt`: the light table was built anew, else only the triangles of groups that were written are.
void Tables::note_lights(std::span<const EmissiveInstance> instances, bool rebuilt) {
  LightState& state = *lights_;
  const LightTable& table = state.table;
  const Scene::Impl& scene = scene_.impl();
  LightSnapshot next;
  next.count = static_cast<std::uint32_t>(table.lights.size());
  next.lamps.reserve(state.lamps.size());
  for (std::size_t i = 0; i < state.lamps.size(); ++i) {
    const std::uint32_t index = table.lamp_index[i];
    const double radius = state.lamps[i].type == HW_LIGHT_SUN ? state.input_radius : 1;
    next.lamps.push_back({state.lamp_kinds[i].first, index, table.lights[index],
                          static_cast<float>(table.weights[index] / (radius * radius))});
  }
  next.world.index = table.world_light;
  next.world.flags = scene.world.flags;
  if (scene.world.material != 0)
    next.world.program = world_revision(scene);
  else
    next.world.color = vec3(scene.world.color[0], scene.world.color[1], scene.world.color[2]);
  next.flux = state.now.flux;
  next.flux.resize(instances.size());
  note_emitters(next, instances, rebuilt);
  state.now = std::move(next);
  state.noted = true;
  state.noted_images = scene.images_revision;
  state.changes = compare_lights(state.taken, state.now);
}

void Tables::note_emitters(LightSnapshot& next, std::span<const EmissiveInstance> instances, bool rebuilt) {
  const Scene::Impl& scene = scene_.impl();
  const std::span<const MaterialRecord> materials(material_table_.data(), material_table_.size());
  std::size_t at = 0;  // among `instances`, which are those of the emissive groups in their order
  for (const auto& [id, slot] : groups_) {
    if (!slot.emissive) continue;
    const InstanceGroup& group = *slot.group;
    MeshSlot& mesh = meshes_.at(group.shared.mesh);
    if (mesh.topology_revision != slot.mesh->revision) {
      mesh.topology = topology_hash(slot.mesh->arrays.tri_vertices, slot.mesh->arrays.tri_slots);
      mesh.topology_revision = slot.mesh->revision;
    }
    LightSnapshot::Emitters emitters{};
    emitters.first = id;
    emitters.instances = static_cast<std::uint32_t>(group.matrices.size());
    emitters.triangles = slot.light_triangles;
    emitters.index = lights_->table.instance_offset[at];
    emitters.slot_begin = static_cast<std::uint32_t>(next.slots.size());
    emitters.slot_count = slot.mesh->summary.max_slot + 1u;
    emitters.flux_begin = static_cast<std::uint32_t>(at);
    emitters.topology = mesh.topology;
    emitters.placed = group.placed_revision;
    emitters.shape = slot.mesh->revision;
    emitters.appearance = group.shared_revision;
    const std::vector<Id>& ids = group.shared.materials;
    for (std::size_t s = 0; s < emitters.slot_count; ++s) {
      LightSnapshot::Slot& light = next.slots.emplace_back();
      const SlotEmission emission = slot_emission(instances[at], materials, s);
      if (!emission.emits) continue;
      light.radiance = static_cast<float>(emission.radiance);
      light.emission = emission.emission;
      light.flags = emission.flags;
      light.back = emission.back;
      if (emission.flags & HW_LIGHT_SHADER) light.program = program_revision(scene, ids[std::min(s, ids.size() - 1)]);
    }
    next.emitters.push_back(emitters);
    auto weight = lights_->table.weights.begin() + emitters.index;
    for (std::size_t i = 0; i < emitters.instances && (rebuilt || slot.written); ++i, weight += emitters.triangles)
      next.flux[at + i] = static_cast<float>(std::accumulate(weight, weight + emitters.triangles, 0.0));
    at += emitters.instances;
  }
}

LightChanges Tables::take_light_changes() {
  LightState& state = *lights_;
  if (state.noted) state.taken = state.now;
  state.noted = false;
  return std::exchange(state.changes, {});
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
  if (name != "uniform" && name != "power" && name != "tree")
    throw std::invalid_argument("unknown way to choose lights: \"" + name + "\" (known: uniform, power, tree)");
  const LightSelection selection = name == "uniform" ? LightSelection::kUniform : LightSelection::kPower;
  LightState& state = *lights_;
  state.wants_tree = name == "tree";
  const bool wants_tree_now = state.wants_tree != state.tree_current;
  if (selection == state.selection && !wants_tree_now) return;
  lights_layout_dirty_ |= selection != state.selection;
  lights_dirty_ = true;
  state.selection = selection;
  relight();
}

// Lights alone, between updates. Where the scene has been edited since the last one, what the tables remember of it may
// be gone: then the next update does it.
void Tables::relight() {
  if (failed_ || seen_ == 0 || seen_ != scene_.impl().revision) return;
  for (auto& [id, slot] : groups_) slot.written = false;
  Uploader uploader(device_);
  TableCounts counts;
  update_lights(uploader, counts);
  tracer_.commit();
  update_root();
  uploader.flush();
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// The light table: order, triangles of emissive instances (on several threads), and the odds of choosing each light.
#include "lights/light_table.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <system_error>
#include <thread>

#include "lights/alias_table.h"
#include "shared/light_kinds.h"

namespace hw {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kTrianglesPerTask = 16384;

double brightness(vec3 v) { return (std::max(v.x, 0.0f) + std::max(v.y, 0.0f) + std::max(v.z, 0.0f)) / 3.0; }

struct Task {
  std::size_t instance, begin, end;
};

// Writes the records and flux estimates of a range of an instance's triangles.
class TriangleWriter {
 public:
  TriangleWriter(const LightTableInput& input, LightTable& table) : input_(input), table_(table) {}

  void run(const std::vector<std::uint32_t>& which) {
    for (std::uint32_t i : which) {
      const std::size_t count = input_.instances[i].tri_vertices.size() / 3;
      for (std::size_t b = 0; b < count; b += kTrianglesPerTask)
        tasks_.push_back({i, b, std::min(count, b + kTrianglesPerTask)});
    }
    unusable_.assign(input_.instances.size(), 0);
    table_.instance_kinds.resize(input_.instances.size());
    for (std::uint32_t i : which) table_.instance_kinds[i] = 0;
    const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
    const std::size_t workers = std::min<std::size_t>(cores, tasks_.size() / 2);
    {
      std::vector<std::jthread> threads;
      try {
        for (std::size_t t = 1; t < workers; ++t) threads.emplace_back([this] { work(); });
      } catch (const std::system_error&) {  // those there are do it
      }
      work();
    }
    if (!error_.empty()) throw SceneError(error_);
    for (std::uint32_t i : which) {
      if (unusable_[i])
        table_.warnings.push_back({input_.instances[i].name, "has emissive triangles that are not finite"});
    }
  }

 private:
  void work() {
    for (std::size_t k = next_++; k < tasks_.size(); k = next_++) {
      try {
        write(tasks_[k]);
      } catch (const std::exception& e) {
        const std::lock_guard lock(mutex_);
        if (error_.empty()) error_ = e.what();
      }
    }
  }

  void write(const Task& task) {
    const EmissiveInstance& in = input_.instances[task.instance];
    const Matrix34& m = in.object_to_world;
    const auto point = [&](std::uint32_t v) {
      const float* p = in.positions.data() + 3 * static_cast<std::size_t>(v);
      return vec3(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3], m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
                  m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]);
    };
    const double determinant =
        glm::dot(glm::dvec3(m[0], m[4], m[8]), glm::cross(glm::dvec3(m[1], m[5], m[9]), glm::dvec3(m[2], m[6], m[10])));
    std::array<SlotEmission, 256> slots;
    const std::size_t slot_count = std::clamp<std::size_t>(in.slot_materials.size(), 1, 256);
    for (std::size_t s = 0; s < slot_count; ++s) slots[s] = slot_emission(in, input_.materials, s);
    const std::size_t vertices = in.positions.size() / 3;
    bool unusable = false;
    std::uint32_t kinds = 0;
    for (std::size_t t = task.begin; t < task.end; ++t) {
      const std::uint32_t* v = in.tri_vertices.data() + 3 * t;
      if (v[0] >= vertices || v[1] >= vertices || v[2] >= vertices) {
        throw SceneError("instance '" + in.name + "': triangle " + std::to_string(t) +
                         " uses a vertex beyond the mesh's " + std::to_string(vertices));
      }
      const std::size_t slot = in.tri_slots.empty() ? 0 : std::min<std::size_t>(in.tri_slots[t], slot_count - 1);
      const SlotEmission& e = slots[slot];
      const std::size_t at = table_.instance_offset[task.instance] + t;
      LightRecord& r = table_.lights[at];
      r = LightRecord{};
      r.type = HW_LIGHT_TRIANGLE;
      r.flags = e.flags;
      r.position = point(v[0]);
      r.axis_x = point(v[1]) - r.position;
      r.axis_y = point(v[2]) - r.position;
      const vec3 normal = glm::cross(r.axis_x, r.axis_y);
      const float twice = glm::length(normal);
      const bool finite = std::isfinite(twice) && std::isfinite(r.position.x + r.position.y + r.position.z);
      unusable |= e.emits && !finite;
      const bool flat = !finite || !(twice > 1e-30f);
      // Cycles: the front of a mirrored instance is where the mesh's front went.
      const float side = (determinant < 0) != e.back ? -1.0f : 1.0f;
      r.axis_z = flat ? vec3(0, 0, 1) : normal * (side / twice);
      r.area = flat ? 0.0f : 0.5f * twice;
      r.emission = flat ? vec3(0) : e.emission;
      r.instance = in.instance;
      r.primitive = static_cast<std::uint32_t>(t);
      r.material = e.material;
      double radiance = e.radiance;
      if ((e.flags & HW_LIGHT_SHADER) && e.emits && !in.radiance.empty()) {
        radiance = in.radiance[t];
        r.emission = flat ? vec3(0) : vec3(in.radiance[t]);
        if (!in.maps.empty() && in.maps[t] != HW_NONE) r.emission_map = in.maps_at + in.maps[t];
      }
      const double sides = (e.flags & HW_LIGHT_TWO_SIDED) ? 2 : 1;
      kinds |= light_kinds(r);
      table_.weights[at] = e.emits ? static_cast<float>(std::min(kPi * r.area * radiance * sides, 3e38)) : 0.0f;
    }
    if (unusable) unusable_[task.instance] = 1;
    std::atomic_ref(table_.instance_kinds[task.instance]) |= kinds;
  }

  const LightTableInput& input_;
  LightTable& table_;
  std::vector<Task> tasks_;
  std::vector<char> unusable_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::string error_;
};

void write_lamps(const LightTableInput& input, LightTable& table) {
  for (std::size_t i = 0; i < input.lamps.size(); ++i) {
    Lamp lamp = make_lamp(input.lamps[i], input.scene_radius);
    const std::uint32_t at = table.lamp_index[i];
    lamp.record.primitive = at;
    table.lights[at] = lamp.record;
    table.shapes[at] = lamp.shape;
    table.weights[at] = lamp.flux;
    if (!lamp.reason.empty()) table.warnings.push_back({input.lamps[i].name, lamp.reason});
  }
  if (table.world_light == HW_NONE) return;
  LightRecord& r = table.lights[table.world_light];
  r = LightRecord{};
  r.type = HW_LIGHT_WORLD;
  r.flags = input.world.flags | HW_LIGHT_CAST_SHADOW;
  r.emission = vec3(input.world.mean_radiance[0], input.world.mean_radiance[1], input.world.mean_radiance[2]);
  r.axis_x = vec3(1, 0, 0);
  r.axis_y = vec3(0, 1, 0);
  r.axis_z = vec3(0, 0, 1);
  r.instance = HW_NONE;
  r.material = input.world.material;
  const double radius = input.scene_radius;
  const double flux = 4 * kPi * brightness(r.emission) * kPi * radius * radius;
  table.weights[table.world_light] = std::isfinite(flux) ? static_cast<float>(std::min(flux, 3e38)) : 0.0f;
}

// The odds from the flux estimates: nothing that emits may become unreachable beside something very strong.
void write_alias(LightSelection selection, LightTable& table) {
  std::vector<float> odds = table.weights;
  double sum = 0;
  std::size_t emitting = 0;
  for (float w : odds) {
    sum += w;
    emitting += w > 0;
  }
  table.total_weight = emitting > 0 ? static_cast<float>(std::min(sum, 3e38)) : 0.0f;
  const double mean = emitting > 0 ? sum / static_cast<double>(emitting) : 0;
  for (float& w : odds) {
    if (!(w > 0)) continue;
    w = selection == LightSelection::kUniform ? 1.0f : static_cast<float>(std::max(w / mean, 1e-5));
  }
  table.alias = build_alias_table(odds);
}

void sum_kinds(LightTable& table) {
  table.kinds = 0;
  const std::size_t others = table.lamp_count + std::size_t{table.world_light != HW_NONE};
  for (const LightRecord& light : table.lights.first(others)) table.kinds |= light_kinds(light);
  for (const std::uint32_t kinds : table.instance_kinds) table.kinds |= kinds;
}

bool is_sun(const LightData& lamp) { return lamp.type == HW_LIGHT_SUN; }

}  // namespace

SlotEmission slot_emission(const EmissiveInstance& instance, std::span<const MaterialRecord> materials,
                           std::size_t slot) {
  SlotEmission e;
  const std::size_t count = instance.slot_materials.size();
  if (count == 0) return e;
  const std::uint32_t index = instance.slot_materials[std::min(slot, count - 1)];
  if (index >= materials.size()) {
    throw SceneError("instance '" + instance.name + "': material index " + std::to_string(index) + " does not exist");
  }
  const MaterialRecord& m = materials[index];
  const bool shader = (m.flags & HW_MATERIAL_EMISSION_SHADER) != 0;
  const vec3 emission = glm::max(m.emission, vec3(0));
  const bool finite = std::isfinite(emission.x) && std::isfinite(emission.y) && std::isfinite(emission.z);
  e.radiance = finite ? brightness(emission) : 0;
  // An emission that varies may be estimated as 0 and still shine somewhere.
  if (shader && !(e.radiance > 0)) e.radiance = 1;
  e.emits = (m.flags & HW_MATERIAL_EMISSIVE) != 0 && (m.flags & HW_MATERIAL_NO_MIS) == 0 && e.radiance > 0;
  e.emission = e.emits && finite ? emission : vec3(0);
  const bool front_only = (m.flags & HW_MATERIAL_EMIT_FRONT) != 0;
  e.back = (m.flags & HW_MATERIAL_EMIT_BACK) != 0 && !front_only;
  const std::uint32_t seen = HW_LIGHT_CAMERA | HW_LIGHT_DIFFUSE | HW_LIGHT_GLOSSY | HW_LIGHT_TRANSMISSION;
  e.flags = HW_LIGHT_CAST_SHADOW | HW_LIGHT_USE_MIS | (instance.flags & seen);
  if (!front_only && !e.back) e.flags |= HW_LIGHT_TWO_SIDED;
  if (shader) e.flags |= HW_LIGHT_SHADER;
  e.material = index;
  return e;
}

LightTable build_light_table(const LightTableInput& input, const LightRoom& room) {
  LightTable table;
  std::size_t count = input.lamps.size() + (input.world.emits ? 1 : 0);
  table.instance_offset.reserve(input.instances.size());
  for (const EmissiveInstance& in : input.instances) {
    if (!in.tri_slots.empty() && in.tri_slots.size() != in.tri_vertices.size() / 3) {
      throw SceneError("instance '" + in.name + "': material slots do not match its triangles");
    }
    table.instance_offset.push_back(static_cast<std::uint32_t>(count));
    count += in.tri_vertices.size() / 3;
    if (count >= HW_NONE) throw SceneError("instance '" + in.name + "': the scene has 2^32 or more lights");
  }
  table.lamp_count = static_cast<std::uint32_t>(input.lamps.size());
  for (const LightData& lamp : input.lamps) table.sun_count += is_sun(lamp);
  table.sun_offset = table.lamp_count - table.sun_count;
  std::uint32_t next_lamp = 0, next_sun = table.sun_offset;
  for (const LightData& lamp : input.lamps) table.lamp_index.push_back(is_sun(lamp) ? next_sun++ : next_lamp++);
  if (input.world.emits) table.world_light = table.lamp_count;
  if (!room) table.own.resize(count);
  table.lights = {room ? room(count) : table.own.data(), count};
  std::fill(table.lights.begin(), table.lights.end(), LightRecord{});
  table.weights.assign(count, 0.0f);
  table.shapes.resize(table.lamp_count);
  write_lamps(input, table);
  std::vector<std::uint32_t> all(input.instances.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
  TriangleWriter(input, table).run(all);
  sum_kinds(table);
  write_alias(input.selection, table);
  return table;
}

void update_light_table(LightTable& table, const LightTableInput& input, std::span<const std::uint32_t> moved) {
  std::uint32_t suns = 0;
  for (const LightData& lamp : input.lamps) suns += is_sun(lamp);
  if (input.lamps.size() != table.lamp_count || suns != table.sun_count ||
      input.instances.size() != table.instance_offset.size() || input.world.emits != (table.world_light != HW_NONE)) {
    throw SceneError("update_light_table: the number of lights changed, build the table anew");
  }
  for (std::size_t i = 0; i < input.lamps.size(); ++i) {
    if (is_sun(input.lamps[i]) != (table.lamp_index[i] >= table.sun_offset)) {
      throw SceneError("update_light_table: lamp '" + input.lamps[i].name + "' changed its kind, build the table anew");
    }
  }
  for (std::uint32_t i : moved) {
    if (i >= input.instances.size()) throw SceneError("update_light_table: instance index out of range");
    const std::size_t end = i + 1 < table.instance_offset.size() ? table.instance_offset[i + 1] : table.lights.size();
    if (input.instances[i].tri_vertices.size() / 3 != end - table.instance_offset[i]) {
      throw SceneError("update_light_table: instance '" + input.instances[i].name +
                       "' changed its mesh, build the table anew");
    }
  }
  const std::vector<float> before = table.weights;
  table.warnings.clear();
  write_lamps(input, table);
  TriangleWriter(input, table).run({moved.begin(), moved.end()});
  sum_kinds(table);
  bool same = true;
  for (std::size_t i = 0; i < before.size() && same; ++i)
    same = std::abs(before[i] - table.weights[i]) <= 1e-4f * before[i];
  if (!same) write_alias(input.selection, table);
}

}  // namespace hw

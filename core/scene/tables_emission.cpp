// SPDX-License-Identifier: Apache-2.0
// Emission that programs give, measured for the odds of lights and of points on them: which meshes are to be measured,
// what is wanted of the stage that does it, and what becomes of the numbers.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lights/emission_map.h"
#include "scene/tables_impl.h"

namespace hw {
namespace {

constexpr std::size_t kPoints = 1u << 20;     // that a round may evaluate in all, where triangles are not too many
constexpr std::size_t kMapFloats = 1u << 20;  // of all maps together
constexpr std::size_t kMaps = 4096;           // of one round
constexpr std::uint32_t kLeastMap = 8, kLargestMap = 64;
constexpr std::size_t kManyTriangles = 1u << 16;
// Of the mean over a mesh, what each of its triangles is taken for at least; and a mesh that looked dark: points are
// measured, and what they missed must be found.
constexpr double kFloor = 1.0 / 64;
constexpr float kDark = 0.01f;

std::uint32_t taps_for(std::size_t cells) {
  const double across = std::sqrt(double(kPoints) / double(std::max<std::size_t>(cells, 1)));
  return static_cast<std::uint32_t>(std::clamp(across, 1.0, 16.0));
}

}  // namespace

// Finds what was measured for each group, and what was not yet.
void Tables::match_emission() {
  LightState& state = *lights_;
  const Scene::Impl& scene = scene_.impl();
  EmissionMeasuring measuring;
  for (auto& [key, measured] : state.emission) measured.used = false;
  for (auto& [id, slot] : groups_) {
    slot.emission = nullptr;
    if (!slot.emissive || !slot.varying) continue;
    const InstanceData& shared = slot.group->shared;
    std::uint64_t revision = slot.mesh->revision;
    for (const Id material : shared.materials)
      if (material != 0) revision = std::max(revision, program_revision(scene, material));
    MeasuredEmission& measured = state.emission[{shared.mesh, shared.materials, shared.color}];
    if (measured.revision != revision && !measured.used)
      measuring.parts.push_back({&measured, revision, slot.base, slot.light_triangles});
    measured.used = true;
    slot.emission = &measured;
  }
  std::erase_if(state.emission, [](const auto& entry) { return !entry.second.used; });
  state.measuring = std::move(measuring);
}

// Asks for the coarse grid, once the lights have their places.
void Tables::want_emission() {
  LightState& state = *lights_;
  EmissionGrid& grid = state.measuring.grid;
  grid = {};
  for (const auto& part : state.measuring.parts) {
    const std::uint32_t first = instance_table_[part.instance].light_offset;
    for (std::uint32_t light = first; light < first + part.triangles; ++light)
      if ((light_table_[light].flags & HW_LIGHT_SHADER) && state.table.weights[light] > 0) grid.lights.push_back(light);
  }
  grid.size = grid.lights.size() <= kManyTriangles ? 4 : 2;
  grid.taps = taps_for(grid.lights.size() * grid.size * grid.size);
}

const EmissionGrid* Tables::emission_wanted() const {
  const EmissionGrid& grid = lights_->measuring.grid;
  return grid.lights.empty() ? nullptr : &grid;
}

void Tables::set_emission(std::span<const float> radiance) {
  EmissionMeasuring& measuring = lights_->measuring;
  const std::size_t cells = std::size_t{measuring.grid.size} * measuring.grid.size;
  if (measuring.grid.lights.empty() || radiance.size() != measuring.grid.lights.size() * cells)
    throw std::invalid_argument("measured emission has " + std::to_string(radiance.size()) + " values for " +
                                std::to_string(measuring.grid.lights.size()) + " lights of " + std::to_string(cells));
  if (measuring.mapped.empty()) {
    take_coarse(radiance);
  } else {
    for (std::size_t i = 0; i < measuring.mapped.size(); ++i) {
      MeasuredEmission& of = *measuring.mapped[i].of;
      of.map.resize(of.radiance.size(), HW_NONE);
      of.map[measuring.mapped[i].triangle] =
          append_emission_map(radiance.subspan(i * cells, cells), measuring.grid.size, of.maps);
    }
    measuring.mapped.clear();
  }
  if (measuring.mapped.empty()) finish_emission();
}

// How bright each triangle is; and the grid over those that need maps, the brightest first where they are many.
void Tables::take_coarse(std::span<const float> values) {
  LightState& state = *lights_;
  EmissionMeasuring& measuring = state.measuring;
  const EmissionGrid grid = std::move(measuring.grid);
  measuring.grid = {};
  const std::size_t cells = std::size_t{grid.size} * grid.size;
  struct Candidate {
    float flux;
    std::uint32_t light;
    EmissionMeasuring::Mapped mapped;
  };
  std::vector<Candidate> candidates;
  std::size_t at = 0;
  for (const auto& part : measuring.parts) {
    MeasuredEmission& of = *part.of;
    of.radiance.assign(part.triangles, 0.0f);
    of.map.clear();
    of.maps.clear();
    const std::uint32_t first = instance_table_[part.instance].light_offset;
    const std::size_t begin = at;
    double flux = 0, area = 0;
    for (; at < grid.lights.size() && grid.lights[at] - first < part.triangles; ++at) {
      const auto here = values.subspan(at * cells, cells);
      const LightRecord& light = light_table_[grid.lights[at]];
      const std::uint32_t triangle = grid.lights[at] - first;
      const float mean = of.radiance[triangle] = emission_mean(here);
      flux += double{mean} * light.area;
      area += light.area;
      if (emission_varies(here)) candidates.push_back({mean * light.area, grid.lights[at], {&of, triangle}});
    }
    const float least = flux > 0 ? static_cast<float>(kFloor * flux / area) : kDark;
    for (std::size_t i = begin; i < at; ++i) {
      float& radiance = of.radiance[grid.lights[i] - first];
      radiance = std::max(radiance, least);
    }
  }
  std::size_t kept = 0;
  for (const auto& [key, measured] : state.emission) kept += measured.maps.size();
  const std::size_t room = kMapFloats - std::min(kept, kMapFloats);
  const std::size_t count = std::min({candidates.size(), kMaps, room / emission_map_floats(kLeastMap)});
  const auto brighter = [](const Candidate& a, const Candidate& b) {
    return a.flux > b.flux || (a.flux == b.flux && a.light < b.light);
  };
  if (count < candidates.size()) {
    std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count), candidates.end(),
                     brighter);
    candidates.resize(count);
  }
  if (candidates.empty()) return;
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.light < b.light; });
  measuring.grid.size = kLargestMap;
  while (measuring.grid.size > kLeastMap && emission_map_floats(measuring.grid.size) * count > room)
    measuring.grid.size /= 2;
  measuring.grid.taps = taps_for(count * measuring.grid.size * measuring.grid.size);
  for (const Candidate& c : candidates) {
    measuring.grid.lights.push_back(c.light);
    measuring.mapped.push_back(c.mapped);
  }
}

// Everything is measured: the lights take it.
void Tables::finish_emission() {
  LightState& state = *lights_;
  bool first_time = false;
  for (const auto& part : state.measuring.parts) {
    first_time |= part.of->revision == 0;
    part.of->revision = part.revision;
  }
  state.measuring = {};
  std::size_t floats = 1;  // none begins at 0
  for (auto& [key, measured] : state.emission) {
    measured.maps_at = static_cast<std::uint32_t>(floats);
    floats += measured.maps.size();
  }
  emission_map_table_.resize(floats);
  float* to = emission_map_table_.edit(0, floats);
  *to++ = 0;
  for (const auto& [key, measured] : state.emission) to = std::copy(measured.maps.begin(), measured.maps.end(), to);
  for (auto& [id, slot] : groups_) slot.remeasured = slot.emission != nullptr;
  if (first_time) state.tree_current = false;  // powers are nothing like what it has
  lights_dirty_ = true;
  relight();
}

}  // namespace hw

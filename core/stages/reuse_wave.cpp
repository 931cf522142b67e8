// SPDX-License-Identifier: Apache-2.0
// Buffers and parameters of light reuse.
#include "stages/reuse_wave.h"

#include <algorithm>

#include "lib/reservoir_race.h"

namespace hw {

namespace {

// Light samples that a cell's reservoir counts as in MIS against BSDF rays. Any number gives the same mean; cells hold
// many samples, so that rays found by the BSDF should be left to what only they find.
constexpr float kCellMisScale = 16;

}  // namespace

ReuseWave::ReuseWave(Device& device, std::uint32_t capacity, std::uint32_t lights, bool cells) {
  auto make = [&](std::size_t element, const char* label) {
    return std::make_unique<Buffer>(device, element * capacity, BufferUse::device, label);
  };
  reservoirs = make(sizeof(Reservoir), "path reservoirs");
  targets = make(sizeof(ReuseSurface), "path targets");
  proxies =
      std::make_unique<Buffer>(device, sizeof(LightProxy) * std::max(lights, 1u), BufferUse::device, "light proxies");
  visible = std::make_unique<Queue>(device, capacity, "visibility queue");
  if (cells) {
    race_keys = make(sizeof(std::uint64_t), "race keys");
    path_cells = make(sizeof(std::uint32_t), "path cells");
  }
}

void ReuseWave::fill(ReuseFrame& frame) const {
  frame.reservoirs = reservoirs->address();
  frame.targets = targets->address();
  frame.race_keys = race_keys ? race_keys->address() : 0;
  frame.path_cells = path_cells ? path_cells->address() : 0;
  frame.proxies = proxies->address();
  frame.visible_queue = visible->address();
}

void ReuseWave::follow_lights(Device& device, ReuseFrame& frame, const LightChanges& changes) {
  light_remap = changes.remap.empty() ? nullptr : device.upload(std::as_bytes(std::span(changes.remap)), "light remap");
  frame.light_remap = light_remap ? light_remap->address() : 0;
  frame.light_remap_count = std::uint32_t(changes.remap.size());
}

int light_sum_exponent(float light_power) { return fixed_exponent(light_power) - 8; }

void apply_reuse(ReuseFrame& f, const ReuseParams& p, std::uint32_t width, std::uint32_t height) {
  f.candidates = p.candidates;
  f.indirect_candidates = p.indirect_candidates;
  f.neighbours = p.neighbours;
  f.radius = p.reuse_radius * float(std::min(width, height));
  f.confidence_cap = float(p.history) * float(p.candidates);
  if (p.unbiased && !p.temporal_reuse) f.confidence_cap = float(std::max(p.candidates, p.indirect_candidates));
  f.history_passes = float(p.history);
  f.record_age = p.temporal_reuse ? std::max(p.history, 1u) : 1;
  f.light_mis_scale = std::max(float(p.candidates), kCellMisScale);
  f.ascension = p.ascension;
  f.grid_radius = p.grid_radius;
  f.cell_inputs = p.cell_inputs;
  f.cell_slots = p.reservoirs_per_cell;
  f.flags = (p.temporal_reuse ? HW_REUSE_TEMPORAL : 0u) | (p.spatial_reuse ? HW_REUSE_SPATIAL : 0u) |
            (p.visibility_reuse ? HW_REUSE_VISIBLE : 0u) | (p.black_where_empty ? HW_REUSE_BLACK : 0u);
}

}  // namespace hw

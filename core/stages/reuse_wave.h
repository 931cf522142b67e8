// SPDX-License-Identifier: Apache-2.0
// The buffers that stages of light reuse add to a wave: a light sample and a target surface for each path, and what a
// path offered to a cell.
#pragma once

#include <cstdint>
#include <memory>

#include "gpu/device.h"
#include "scene/light_identity.h"
#include "session/reuse_settings.h"
#include "shared/path.h"
#include "stages/stage.h"

namespace hw {

class ReuseWave {
 public:
  // `cells`: paths offer samples to cells. `lights`: in the light table. Throws OutOfMemory.
  ReuseWave(Device& device, std::uint32_t capacity, std::uint32_t lights, bool cells);
  // What samples kept from the last frame need to know about the lights.
  void follow_lights(Device& device, ReuseFrame& frame, const LightChanges& changes);
  // Points a frame's parameters at the buffers.
  void fill(ReuseFrame& frame) const;

  std::unique_ptr<Buffer> reservoirs, targets, race_keys, path_cells, proxies, light_remap;
  std::unique_ptr<Queue> visible;  // candidates whose visibility is asked for
};

// The scale of fixed-point sums (lib/reservoir_race.h) of light at surfaces, for lights of so much power in all [W].
// Typical terms are irradiances at some metres from the lights: well below their power.
int light_sum_exponent(float light_power);

// Fills the parts of ReuseFrame that settings decide. width, height: of the full picture, pixels.
void apply_reuse(ReuseFrame& frame, const ReuseParams& params, std::uint32_t width, std::uint32_t height);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Where a light is, which way it sends light, and how much: what the light tree is built of.
#pragma once

#include "shared/lights.h"

namespace hw {

struct LightBounds {
  vec3 low{0}, high{0};  // world box; distant: box of directions towards the light
  vec3 axis{0, 0, 1};    // of the emission cone, unit; distant: towards the light
  float theta_o = 0;     // widest angle of a normal about the axis [rad]; distant: of a direction
  float theta_e = 0;     // widest angle of light about a normal [rad]
  float power = 0;       // largest radiant intensity [W sr^-1]; distant: irradiance [W m^-2]
  bool distant = false;
  bool two_sided = false;  // along the axis and against it
};

// Conservative bounds of one light, from its record. `weight`: its flux estimate in the light table [W], positive;
// `scene_radius` [m]: what that of suns and the world was taken over.
LightBounds light_bounds(const LightRecord& light, float weight, float scene_radius);

// Bounds of two lights or groups of lights together; the cone by Conty Estevez and Kulla 2018, algorithm 1. Of a
// distant one and another: an unbounded box and all directions.
LightBounds unite(const LightBounds& a, const LightBounds& b);

}  // namespace hw

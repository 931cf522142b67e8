// SPDX-License-Identifier: Apache-2.0
// What the tests of light reuse share: one light of every kind, and receivers at which samplers go wrong.
#pragma once

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "lib/light_point.h"
#include "lib/sampler.h"
#include "lights/light_table.h"

namespace hw::light_test {

struct Random {
  std::mt19937 engine;
  explicit Random(std::uint32_t seed) : engine(seed) {}
  float operator()(float a = 0, float b = 1) {
    return a + (b - a) * std::uniform_real_distribution<float>(0, 0.9999999f)(engine);
  }
  vec3 direction() { return warp_sphere(vec2((*this)(), (*this)())); }
};

struct LightCase {
  std::string name;
  LightRecord light;
  float reach;  // size of the light, for placing receivers near and far [m]; suns and the world: 1
};

// Columns x, y, z of a right-handed frame about z, at a place.
inline Matrix34 placed(vec3 at, vec3 z, float turn = 0.4f, vec3 scale = vec3(1)) {
  vec3 x, y;
  warp_frame(z, x, y);
  const vec3 tx = x * std::cos(turn) + y * std::sin(turn), ty = y * std::cos(turn) - x * std::sin(turn);
  Matrix34 m;
  for (int i = 0; i < 3; ++i) {
    m[4 * i] = tx[i] * scale.x;
    m[4 * i + 1] = ty[i] * scale.y;
    m[4 * i + 2] = z[i] * scale.z;
    m[4 * i + 3] = at[i];
  }
  return m;
}

inline LightRecord triangle(vec3 a, vec3 b, vec3 c, vec3 emission, bool two_sided) {
  LightRecord r{};
  r.type = HW_LIGHT_TRIANGLE;
  r.flags = HW_LIGHT_CAST_SHADOW | HW_LIGHT_USE_MIS | HW_LIGHT_DIFFUSE | HW_LIGHT_GLOSSY | HW_LIGHT_TRANSMISSION |
            (two_sided ? HW_LIGHT_TWO_SIDED : 0u);
  r.position = a;
  r.axis_x = b - a;
  r.axis_y = c - a;
  const vec3 n = cross(r.axis_x, r.axis_y);
  r.area = 0.5f * length(n);
  r.axis_z = normalize(n);
  r.emission = emission;
  return r;
}

// One light of every kind and of every way it is sampled, at random places.
inline std::vector<LightCase> light_cases(std::uint32_t seed) {
  Random random(seed);
  std::vector<LightCase> cases;
  auto lamp = [&](const char* name, std::uint32_t type, float reach, auto&& edit, vec3 scale = vec3(1)) {
    LightData d;
    d.name = name;
    d.type = type;
    d.object_to_world = placed(random.direction() * 2.0f, random.direction(), random(0, 6), scale);
    d.power = 100;
    d.color = {1.0f, 0.6f, 0.3f};
    edit(d);
    const Lamp made = make_lamp(d, 10);
    cases.push_back({name, made.record, reach});
  };
  const float r = random(0.05f, 0.6f);
  const std::uint32_t soft = HW_LIGHT_SOFT_FALLOFF;
  const float half_turn = 3.14159265f;
  lamp("point", HW_LIGHT_POINT, 0.1f, [](auto&) {});
  lamp("point, sphere", HW_LIGHT_POINT, r, [&](auto& d) { d.radius = r; });
  lamp("point, disk", HW_LIGHT_POINT, r, [&](auto& d) { d.radius = r, d.flags |= soft; });
  lamp("spot", HW_LIGHT_SPOT, 0.1f, [&](auto& d) { d.spot_size = random(0.3f, 3), d.spot_blend = random(0.05f, 1); });
  lamp("spot without blend", HW_LIGHT_SPOT, 0.1f, [&](auto& d) { d.spot_size = random(0.1f, 3), d.spot_blend = 0; });
  lamp("spot with a sharp edge", HW_LIGHT_SPOT, 0.1f,
       [&](auto& d) { d.spot_size = random(0.1f, 3), d.spot_blend = random(1e-4f, 0.02f); });
  lamp("spot, sphere", HW_LIGHT_SPOT, r,
       [&](auto& d) { d.radius = r, d.spot_size = random(0.5f, 3), d.spot_blend = random(); });
  lamp("spot, disk", HW_LIGHT_SPOT, r,
       [&](auto& d) { d.radius = r, d.flags |= soft, d.spot_size = random(0.5f, 3), d.spot_blend = random(); });
  lamp(
      "spot, stretched", HW_LIGHT_SPOT, r, [&](auto& d) { d.radius = r, d.spot_size = 1, d.spot_blend = 0.5f; },
      vec3(2, 0.5f, 1.3f));
  lamp("sun", HW_LIGHT_SUN, 1, [](auto& d) { d.power = 3; });
  lamp("sun of a degree", HW_LIGHT_SUN, 1, [](auto& d) { d.power = 3, d.angle = 0.0174f; });
  lamp("sun of a third of the sky", HW_LIGHT_SUN, 1, [](auto& d) { d.power = 3, d.angle = 2.2f; });
  lamp("sun of half the sky", HW_LIGHT_SUN, 1, [&](auto& d) { d.power = 3, d.angle = half_turn; });
  auto area = [&](const char* name, bool ellipse, float spread, vec3 scale = vec3(1)) {
    const float x = random(0.2f, 2), y = random(0.2f, 2);
    lamp(
        name, HW_LIGHT_AREA, std::max(x, y),
        [&](auto& d) { d.size_x = x, d.size_y = y, d.ellipse = ellipse, d.spread = spread; }, scale);
  };
  area("rectangle", false, half_turn);
  area("ellipse", true, half_turn);
  area("rectangle, mirrored", false, half_turn, vec3(-1.5f, 1, 1));
  area("rectangle with a spread", false, 1.5f);
  area("ellipse with a spread", true, 1.5f);
  area("rectangle without a spread", false, 0);
  for (const bool two_sided : {false, true}) {
    const vec3 a = random.direction() * 2.0f;
    const float size = random(0.1f, 1.5f);
    cases.push_back(
        {two_sided ? "triangle, two sides" : "triangle",
         triangle(a, a + random.direction() * size, a + random.direction() * size, vec3(2, 1, 3), two_sided), size});
  }
  return cases;
}

// A place that the light reaches, mostly: `how` counts through far, near, very near and very far ones.
inline vec3 receiver(const LightCase& c, int how, Random& random) {
  const LightRecord& l = c.light;
  if (l.type == HW_LIGHT_SUN || l.type == HW_LIGHT_WORLD) return random.direction() * 10.0f;
  const float distance = std::array{random(1, 8), random(0.3f, 1), random(0.01f, 0.3f), random(20, 100)}[how % 4];
  vec3 center = l.position, ahead = random.direction();
  if (l.type == HW_LIGHT_TRIANGLE) {
    center += l.axis_x * random(0, 0.7f) + l.axis_y * random(0, 0.7f);
    if (how % 8 < 6) ahead = normalize(ahead + l.axis_z * (how % 2 && (l.flags & HW_LIGHT_TWO_SIDED) ? -1.2f : 1.2f));
  } else if (l.type == HW_LIGHT_AREA) {
    center += l.axis_x * (l.size_x * random(-0.5f, 0.5f)) + l.axis_y * (l.size_y * random(-0.5f, 0.5f));
    const float spread = l.spot_smooth > 0 ? l.spread_or_spot : 1;
    ahead = normalize(ahead * std::min(spread, 1.0f) - l.axis_z * 1.2f);
  } else if (l.type == HW_LIGHT_SPOT) {
    vec3 axis = cross(l.axis_x, l.axis_y);
    axis = normalize(dot(axis, l.axis_z) < 0 ? -axis : axis);
    ahead = normalize(ahead * 0.9f * std::sqrt(1 - std::min(l.spread_or_spot * l.spread_or_spot, 1.0f)) - axis);
  }
  return center + ahead * (distance * c.reach);
}

// The point of a light that two uniform numbers choose evenly over its measure (light_point.h), as its place uv.
inline vec2 even_place(const LightRecord& l, vec2 u) {
  if (l.type == HW_LIGHT_TRIANGLE) return u.x + u.y > 1 ? vec2(1) - u : u;
  if (l.type == HW_LIGHT_AREA && (l.flags & HW_LIGHT_ELLIPSE)) return warp_disk(u) * 0.5f + vec2(0.5f);
  return u;
}

// Sum, and sum of squares, for means with an error.
struct Mean {
  double sum = 0, squares = 0;
  std::size_t n = 0;
  void add(double v) {
    sum += v;
    squares += v * v;
    ++n;
  }
  double mean() const { return sum / double(n); }
  double error() const {
    const double m = mean();
    return std::sqrt(std::max(0.0, squares / double(n) - m * m) / double(n));
  }
};

}  // namespace hw::light_test

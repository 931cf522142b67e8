// SPDX-License-Identifier: Apache-2.0
// What the tests of closures share: one case a closure type, and integration over the sphere and the unit cube.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "lib/closure_builders.h"
#include "lib/closures.h"

namespace hw::closure_test {

inline const vec3 kN(0.0f, 0.0f, 1.0f);
inline const vec3 kX(1.0f, 0.0f, 0.0f);

inline ShadingGeometry geometry(float cos_o, float azimuth = 0.3f) {
  ShadingGeometry g;
  const float s = std::sqrt(1.0f - cos_o * cos_o);
  g.wo = vec3(s * std::cos(azimuth), s * std::sin(azimuth), cos_o);
  g.Ng = g.Ns = kN;
  g.flags = HW_SHADE_BUMP_CORRECTION;
  return g;
}

inline PrincipledInputs principled() {
  PrincipledInputs p{};
  p.base_color = vec3(0.8f, 0.4f, 0.2f);
  p.roughness = 0.5f;
  p.ior = 1.5f;
  p.alpha = 1.0f;
  p.normal = kN;
  p.specular_ior_level = 0.5f;
  p.specular_tint = vec3(1.0f);
  p.tangent = kX;
  p.coat_roughness = 0.1f;
  p.coat_ior = 1.5f;
  p.coat_tint = vec3(1.0f);
  p.coat_normal = kN;
  p.sheen_roughness = 0.5f;
  p.sheen_tint = vec3(1.0f);
  p.multiscatter = 1u;
  return p;
}

using Builder = std::function<void(ClosureList&, const ShadingGeometry&)>;
struct Case {
  const char* name;
  Builder build;
};

inline const std::vector<Case>& cases() {
  static const vec3 one(1.0f);
  static const std::vector<Case> list = {
      {"diffuse", [](auto& l, auto& g) { closures_add_diffuse(l, g, 1.0f, one, 0.0f, kN); }},
      {"rough diffuse", [](auto& l, auto& g) { closures_add_diffuse(l, g, 1.0f, one, 0.8f, kN); }},
      {"translucent", [](auto& l, auto& g) { closures_add_translucent(l, g, 1.0f, one, kN); }},
      {"sheen", [](auto& l, auto& g) { closures_add_sheen(l, g, 1.0f, one, 0.4f, kN); }},
      {"toon", [](auto& l, auto& g) { closures_add_toon(l, g, 1.0f, one, 0.4f, 0.3f, 0u, kN); }},
      {"glossy toon", [](auto& l, auto& g) { closures_add_toon(l, g, 1.0f, one, 0.4f, 0.3f, 1u, kN); }},
      {"glossy 0.3", [](auto& l, auto& g) { closures_add_glossy(l, g, 1.0f, one, 0.3f, 0.0f, 0.0f, kN, kX, 0u); }},
      {"glossy 0.9", [](auto& l, auto& g) { closures_add_glossy(l, g, 1.0f, one, 0.9f, 0.0f, 0.0f, kN, kX, 1u); }},
      {"stretched", [](auto& l, auto& g) { closures_add_glossy(l, g, 1.0f, one, 0.6f, 0.7f, 0.15f, kN, kX, 0u); }},
      {"metal",
       [](auto& l, auto& g) {
         closures_add_metallic_f82(l, g, 1.0f, vec3(0.9f, 0.5f, 0.3f), vec3(0.5f), 0.5f, 0.5f, 0.2f, kN, kX, 1u);
       }},
      {"conductor",
       [](auto& l, auto& g) {
         closures_add_metallic_conductor(l, g, 1.0f, vec3(0.2f, 0.9f, 1.1f), vec3(3.0f, 2.2f, 2.0f), 0.4f, 0.0f, 0.0f,
                                         kN, kX, 1u);
       }},
      {"glass 0.4", [](auto& l, auto& g) { closures_add_glass(l, g, 1.0f, one, 0.4f, 1.5f, kN, 0u); }},
      {"glass 0.9", [](auto& l, auto& g) { closures_add_glass(l, g, 1.0f, one, 0.9f, 1.8f, kN, 1u); }},
      {"glass from inside",
       [](auto& l, auto& g) {
         ShadingGeometry inside = g;
         inside.flags |= HW_SHADE_BACKFACING;
         closures_add_glass(l, inside, 1.0f, one, 0.5f, 1.5f, kN, 1u);
       }},
      {"refraction", [](auto& l, auto& g) { closures_add_refraction(l, g, 1.0f, one, 0.5f, 1.4f, kN); }},
      {"principled", [](auto& l, auto& g) { closures_add_principled(l, g, 1.0f, principled()); }},
      {"principled all",
       [](auto& l, auto& g) {
         PrincipledInputs p = principled();
         p.metallic = 0.3f, p.transmission_weight = 0.4f, p.coat_weight = 0.6f, p.coat_roughness = 0.4f,
         p.sheen_weight = 0.5f;
         p.diffuse_roughness = 0.5f, p.anisotropic = 0.5f, p.roughness = 0.6f;
         closures_add_principled(l, g, 1.0f, p);
       }},
  };
  return list;
}

inline ClosureList build(const Builder& b, const ShadingGeometry& g) {
  ClosureList list;
  b(list, g);
  closures_finish(list);
  return list;
}

// Stratified points of the unit cube, n^3.
template <typename F>
void stratified(int n, unsigned seed, F f) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(0.0f, 1.0f);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const vec3 p((i + u(random)) / n, (j + u(random)) / n, (k + u(random)) / n);
        f(min(p, vec3(0.99999994f)));
      }
}

inline vec3 white_albedo(const ClosureList& list, const ShadingGeometry& g, int n = 32) {
  glm::dvec3 sum(0.0);
  stratified(n, 1u, [&](vec3 u) {
    const BsdfSample s = closures_sample(list, g, u);
    if (s.label != HW_LABEL_NONE) sum += glm::dvec3(bsdf_value_total(s.value)) / double(s.value.pdf);
  });
  return vec3(sum / double(n * n * n));
}

// Over the sphere, in cells of equal solid angle with 2 x 2 points each: f(direction, solid angle of the point).
template <typename F>
void over_sphere(int rows, F f) {
  const int columns = 2 * rows;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const float z = 1.0f - 2.0f * (i + 0.5f) / rows, phi = 2.0f * HW_PI * (j + 0.5f) / columns;
      const float s = std::sqrt(std::max(1.0f - z * z, 0.0f));
      f(vec3(s * std::cos(phi), s * std::sin(phi), z), 4.0 * HW_PI / (rows * columns));
    }
}

inline bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace hw::closure_test

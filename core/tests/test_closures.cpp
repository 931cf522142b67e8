// SPDX-License-Identifier: Apache-2.0
// Closures against themselves: energy, reciprocity, densities that integrate to what is sampled, samples distributed as the
// densities say, no NaN. What they should be is test_closure_reference.cpp's matter.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "lib/closure_builders.h"
#include "lib/closures.h"
#include "materials/luts.h"

using namespace hw;

namespace {

const vec3 kN(0.0f, 0.0f, 1.0f);
const vec3 kX(1.0f, 0.0f, 0.0f);

ShadingGeometry geometry(float cos_o, float azimuth = 0.3f) {
  ShadingGeometry g;
  const float s = std::sqrt(1.0f - cos_o * cos_o);
  g.wo = vec3(s * std::cos(azimuth), s * std::sin(azimuth), cos_o);
  g.Ng = g.Ns = kN;
  g.flags = HW_SHADE_BUMP_CORRECTION;
  return g;
}

PrincipledInputs principled() {
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

const std::vector<Case>& cases() {
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
      {"metal", [](auto& l, auto& g) { closures_add_metallic_f82(l, g, 1.0f, vec3(0.9f, 0.5f, 0.3f), vec3(0.5f), 0.5f, 0.5f, 0.2f, kN, kX, 1u); }},
      {"conductor", [](auto& l, auto& g) { closures_add_metallic_conductor(l, g, 1.0f, vec3(0.2f, 0.9f, 1.1f), vec3(3.0f, 2.2f, 2.0f), 0.4f, 0.0f, 0.0f, kN, kX, 1u); }},
      {"glass 0.4", [](auto& l, auto& g) { closures_add_glass(l, g, 1.0f, one, 0.4f, 1.5f, kN, 0u); }},
      {"glass 0.9", [](auto& l, auto& g) { closures_add_glass(l, g, 1.0f, one, 0.9f, 1.8f, kN, 1u); }},
      {"glass from inside", [](auto& l, auto& g) { ShadingGeometry inside = g; inside.flags |= HW_SHADE_BACKFACING; closures_add_glass(l, inside, 1.0f, one, 0.5f, 1.5f, kN, 1u); }},
      {"refraction", [](auto& l, auto& g) { closures_add_refraction(l, g, 1.0f, one, 0.5f, 1.4f, kN); }},
      {"principled", [](auto& l, auto& g) { closures_add_principled(l, g, 1.0f, principled()); }},
      {"principled all", [](auto& l, auto& g) {
         PrincipledInputs p = principled();
         p.metallic = 0.3f, p.transmission_weight = 0.4f, p.coat_weight = 0.6f, p.coat_roughness = 0.4f, p.sheen_weight = 0.5f;
         p.diffuse_roughness = 0.5f, p.anisotropic = 0.5f, p.roughness = 0.6f;
         closures_add_principled(l, g, 1.0f, p);
       }},
  };
  return list;
}

ClosureList build(const Builder& b, const ShadingGeometry& g) {
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

vec3 white_albedo(const ClosureList& list, const ShadingGeometry& g, int n = 32) {
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

bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

TEST_CASE("closure record: octahedral normals and half colours keep their precision") {
  std::mt19937 random(3);
  std::normal_distribution<float> d;
  float worst = 0.0f;
  for (int i = 0; i < 20000; ++i) {
    const vec3 v = normalize(vec3(d(random), d(random), d(random)));
    worst = std::max(worst, length(octahedral_unpack(octahedral_pack(v)) - v));
  }
  CHECK(worst < 7e-5f);
  Closure c = closure_make(HW_CLOSURE_GLOSSY, geometry(0.5f), vec3(1.0f), kN);
  closure_set_colors(c, vec3(0.1f, 0.2f, 0.3f), vec3(-4.0f, 5.0f, 6.0f));
  CHECK(length(closure_color0(c) - vec3(0.1f, 0.2f, 0.3f)) < 2e-4f);
  CHECK(length(closure_color1(c) - vec3(-4.0f, 5.0f, 6.0f)) < 1e-6f);
}

TEST_CASE("stored albedo tables are the integrals they say") {
  const std::vector<float> fresh = integrate_albedo_luts(24);
  const std::span<const float> stored = albedo_lut_table();
  REQUIRE(stored.size() == HW_LUT_COUNT);
  double sum2 = 0.0, worst = 0.0;
  for (size_t i = 0; i < fresh.size(); ++i) {
    const double d = std::abs(double(fresh[i]) - stored[i]);
    sum2 += d * d;
    worst = std::max(worst, d);
  }
  CHECK(std::sqrt(sum2 / fresh.size()) < 6e-4);
  CHECK(worst < 2e-2);  // at the edge of total internal reflection, where 24 points an axis are few
}

TEST_CASE("white furnace: multiscatter GGX loses nothing") {
  for (float roughness : {0.0f, 0.1f, 0.25f, 0.4f, 0.55f, 0.7f, 0.85f, 1.0f}) {
    for (float cos_o : {1.0f, 0.8f, 0.5f, 0.3f, 0.15f}) {
      CAPTURE(roughness);
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      ClosureList glossy, metal, glass, inside;
      closures_add_glossy(glossy, g, 1.0f, vec3(1.0f), roughness, 0.0f, 0.0f, kN, kX, 1u);
      closures_add_metallic_f82(metal, g, 1.0f, vec3(1.0f), vec3(1.0f), roughness, 0.0f, 0.0f, kN, kX, 1u);
      closures_add_glass(glass, g, 1.0f, vec3(1.0f), roughness, 1.5f, kN, 1u);
      ShadingGeometry back = g;
      back.flags |= HW_SHADE_BACKFACING;
      closures_add_glass(inside, back, 1.0f, vec3(1.0f), roughness, 1.5f, kN, 1u);
      CHECK(white_albedo(glossy, g).x == doctest::Approx(1.0).epsilon(0.01));
      CHECK(white_albedo(metal, g).x == doctest::Approx(1.0).epsilon(0.01));
      CHECK(white_albedo(glass, g).x == doctest::Approx(1.0).epsilon(0.01));
      // From the dense side the 16 cosines of the table straddle the edge of total reflection.
      CHECK(white_albedo(inside, back).x == doctest::Approx(1.0).epsilon(0.03));
    }
  }
}

TEST_CASE("no material returns more than it gets") {
  for (const Case& c : cases()) {
    for (float cos_o : {1.0f, 0.6f, 0.2f, 0.05f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const vec3 albedo = white_albedo(build(c.build, g), g, 24);
      CHECK(max3(albedo) < 1.03f);
      CHECK(max3(albedo) > 0.0f);
    }
  }
}

TEST_CASE("reflection is reciprocal where the model is") {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(0.05f, 1.0f), turn(0.0f, 6.28f);
  // Without energy restored and layers, which depend on the viewer only.
  const Builder reciprocal[] = {
      [](auto& l, auto& g) { closures_add_diffuse(l, g, 1.0f, vec3(0.7f), 0.8f, kN); },
      [](auto& l, auto& g) { closures_add_glossy(l, g, 1.0f, vec3(0.7f), 0.6f, 0.0f, 0.0f, kN, kX, 0u); },
      [](auto& l, auto& g) { closures_add_glossy(l, g, 1.0f, vec3(0.7f), 0.6f, 0.6f, 0.1f, kN, kX, 0u); },
      [](auto& l, auto& g) { closures_add_metallic_f82(l, g, 1.0f, vec3(0.7f), vec3(0.3f), 0.5f, 0.4f, 0.1f, kN, kX, 0u); },
      [](auto& l, auto& g) { closures_add_glass(l, g, 1.0f, vec3(0.7f), 0.5f, 1.5f, kN, 0u); }};
  for (const Builder& b : reciprocal) {
    for (int i = 0; i < 200; ++i) {
      const ShadingGeometry a = geometry(u(random), turn(random)), c = geometry(u(random), turn(random));
      const vec3 forth = bsdf_value_total(closures_eval(build(b, a), a, c.wo)) / c.wo.z;
      const vec3 back = bsdf_value_total(closures_eval(build(b, c), c, a.wo)) / a.wo.z;
      CHECK(forth.x == doctest::Approx(back.x).epsilon(1e-3));
    }
  }
}

TEST_CASE("refraction obeys the reciprocity of radiance over n^2") {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> u(0.1f, 1.0f), turn(0.0f, 6.28f);
  for (int i = 0; i < 500; ++i) {
    const ShadingGeometry above = geometry(u(random), turn(random));
    ShadingGeometry below = geometry(u(random), turn(random));
    below.flags |= HW_SHADE_BACKFACING;  // its frame is turned over: the side of the viewer is up
    const vec3 to_below = vec3(below.wo.x, below.wo.y, -below.wo.z), to_above = vec3(above.wo.x, above.wo.y, -above.wo.z);
    ClosureList from_above, from_below;
    closures_add_glass(from_above, above, 1.0f, vec3(1.0f), 0.6f, 1.5f, kN, 0u);
    closures_add_glass(from_below, below, 1.0f, vec3(1.0f), 0.6f, 1.5f, kN, 0u);
    const float down = bsdf_value_total(closures_eval(from_above, above, to_below)).x / below.wo.z;
    const float up = bsdf_value_total(closures_eval(from_below, below, to_above)).x / above.wo.z;
    // f(a, b) / n_b^2 = f(b, a) / n_a^2, light arriving from b.
    CHECK(down / (1.5f * 1.5f) == doctest::Approx(up).epsilon(2e-3));
  }
}

TEST_CASE("densities integrate to the share of samples that succeed") {
  for (const Case& c : cases()) {
    for (float cos_o : {0.95f, 0.5f, 0.15f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      double integral = 0.0, sampled = 0.0;
      over_sphere(600, [&](vec3 w, double d) { integral += closures_eval(list, g, w).pdf * d; });
      stratified(32, 2u, [&](vec3 u) { sampled += closures_sample(list, g, u).label != HW_LABEL_NONE; });
      sampled /= 32.0 * 32.0 * 32.0;
      CHECK(integral == doctest::Approx(sampled).epsilon(0.01));
    }
  }
}

TEST_CASE("samples carry the value and density that evaluation gives") {
  for (const Case& c : cases()) {
    for (float cos_o : {0.9f, 0.4f, 0.1f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      stratified(8, 3u, [&](vec3 u) {
        const BsdfSample s = closures_sample(list, g, u);
        if (s.label == HW_LABEL_NONE || (s.label & HW_LABEL_SINGULAR) != 0u) return;
        const BsdfValue v = closures_eval(list, g, s.wi);
        CHECK(s.value.pdf == doctest::Approx(v.pdf).epsilon(5e-3));
        CHECK(bsdf_value_total(s.value).y == doctest::Approx(bsdf_value_total(v).y).epsilon(5e-3));
        CHECK(length(s.wi) == doctest::Approx(1.0).epsilon(1e-5));
        CHECK((dot(s.wi, kN) < 0.0f) == ((s.label & HW_LABEL_TRANSMIT) != 0u));
      });
    }
  }
}

TEST_CASE("samples fall as often as their density says") {
  // Cells of equal solid angle about an axis of their own, so that no edge of a lobe runs along them. Expected counts by the
  // midpoint rule within the cells; chi-square, the significance shared among all tests (Sidak).
  constexpr int kRows = 12, kColumns = 24, kSub = 24, kSamples = 40000;
  const vec3 axis = normalize(vec3(0.3f, -0.5f, 0.7f));
  vec3 x, y;
  warp_frame(axis, x, y);
  const double tests = cases().size() * 2.0, significance = 1.0 - std::pow(0.99, 1.0 / tests);
  for (const Case& c : cases()) {
    for (float cos_o : {0.8f, 0.25f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      std::vector<double> expected(kRows * kColumns + 1, 0.0), found(expected.size(), 0.0);
      double inside = 0.0;
      for (int i = 0; i < kRows * kSub; ++i) {
        for (int j = 0; j < kColumns * kSub; ++j) {
          const float z = 1.0f - 2.0f * (i + 0.5f) / (kRows * kSub), phi = 2.0f * HW_PI * (j + 0.5f) / (kColumns * kSub);
          const float s = std::sqrt(1.0f - z * z);
          const vec3 w = s * std::cos(phi) * x + s * std::sin(phi) * y + z * axis;
          const double p = closures_eval(list, g, w).pdf * 4.0 * HW_PI / (double(kRows) * kColumns * kSub * kSub);
          expected[(i / kSub) * kColumns + j / kSub] += p * kSamples;
          inside += p;
        }
      }
      expected.back() = std::max(1.0 - inside, 0.0) * kSamples;  // no direction
      std::mt19937 random(11);
      std::uniform_real_distribution<float> u(0.0f, 1.0f);
      for (int i = 0; i < kSamples; ++i) {
        const BsdfSample s = closures_sample(list, g, min(vec3(u(random), u(random), u(random)), vec3(0.99999994f)));
        size_t cell = expected.size() - 1;
        if (s.label != HW_LABEL_NONE) {
          const float turn = std::atan2(dot(s.wi, y), dot(s.wi, x)) / (2.0f * HW_PI);
          const int row = std::clamp(int((1.0f - dot(s.wi, axis)) * 0.5f * kRows), 0, kRows - 1);
          cell = row * kColumns + std::min(int((turn < 0.0f ? turn + 1.0f : turn) * kColumns), kColumns - 1);
        }
        found[cell] += 1.0;
      }
      double chi2 = 0.0, pooled_expected = 0.0, pooled_found = 0.0;
      int freedom = -1;
      auto count = [&](double e, double f) {
        chi2 += (f - e) * (f - e) / e;
        ++freedom;
      };
      for (size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] >= 8.0) {
          count(expected[i], found[i]);
        } else {
          pooled_expected += expected[i];
          pooled_found += found[i];
        }
      }
      if (pooled_expected > 8.0) count(pooled_expected, pooled_found);
      // Wilson and Hilferty: the cube root of chi2 / freedom is nearly normal.
      const double z = (std::cbrt(chi2 / freedom) - (1.0 - 2.0 / (9.0 * freedom))) / std::sqrt(2.0 / (9.0 * freedom));
      const double p_value = 0.5 * std::erfc(z / std::sqrt(2.0));
      CAPTURE(chi2);
      CAPTURE(freedom);
      CHECK(p_value > significance);
    }
  }
}

TEST_CASE("deltas: mirrors, glass and transparency") {
  const ShadingGeometry g = geometry(0.6f);
  ClosureList mirror;
  closures_add_glossy(mirror, g, 1.0f, vec3(0.9f), 0.0f, 0.0f, 0.0f, kN, kX, 1u);
  const BsdfSample s = closures_sample(mirror, g, vec3(0.3f, 0.6f, 0.5f));
  CHECK(s.label == (HW_LABEL_REFLECT | HW_LABEL_SINGULAR));
  CHECK(length(s.wi - vec3(-g.wo.x, -g.wo.y, g.wo.z)) < 1e-6f);
  CHECK(s.value.pdf == doctest::Approx(1.0));
  CHECK(s.value.glossy.x == doctest::Approx(0.9).epsilon(1e-4));
  CHECK(closures_eval(mirror, g, s.wi).pdf == 0.0f);
  CHECK(closure_is_singular(mirror.at[0]));
  Closure blurred = mirror.at[0];
  closure_blur(blurred, 0.2f);
  CHECK_FALSE(closure_is_singular(blurred));

  ClosureList glass;
  closures_add_glass(glass, g, 1.0f, vec3(1.0f), 0.0f, 1.5f, kN, 1u);
  double reflected = 0.0;
  stratified(24, 5u, [&](vec3 u) {
    const BsdfSample t = closures_sample(glass, g, u);
    CHECK((t.label & HW_LABEL_SINGULAR) != 0u);
    CHECK(bsdf_value_total(t.value).x / t.value.pdf == doctest::Approx(1.0).epsilon(1e-3));
    reflected += (t.label & HW_LABEL_REFLECT) != 0u;
    if ((t.label & HW_LABEL_TRANSMIT) != 0u) {
      CHECK(t.eta == 1.5f);
      CHECK(length(vec3(t.wi.x, t.wi.y, 0.0f)) * 1.5f == doctest::Approx(std::sqrt(1.0f - 0.36f)).epsilon(1e-4));
    }
  });
  float cos_t;
  CHECK(reflected / (24 * 24 * 24) == doctest::Approx(fresnel_dielectric(0.6f, 1.5f, cos_t)).epsilon(0.02));

  ClosureList half;
  PrincipledInputs p = principled();
  p.alpha = 0.25f;
  closures_add_principled(half, g, 1.0f, p);
  closures_add_transparent(half, 0.5f, vec3(0.2f));
  closures_finish(half);
  CHECK(closures_transparency(half).x == doctest::Approx(0.85));
  CHECK(half.at[half.count - 1u].type == HW_CLOSURE_TRANSPARENT);
}

TEST_CASE("a full list keeps its transparency and drops the rest") {
  const ShadingGeometry g = geometry(0.6f);
  ClosureList list;
  for (int i = 0; i < 12; ++i) closures_add_diffuse(list, g, 0.05f, vec3(1.0f), 0.0f, kN);
  closures_add_transparent(list, 0.4f, vec3(1.0f));
  closures_finish(list);
  CHECK(list.count == HW_MAX_CLOSURES);
  CHECK(closures_transparency(list).x == doctest::Approx(0.4));
}

TEST_CASE("caustics switched off leave the lobes out") {
  ShadingGeometry g = geometry(0.6f);
  g.flags |= HW_SHADE_NO_REFLECTIVE_CAUSTICS;
  ClosureList list;
  PrincipledInputs p = principled();
  p.coat_weight = 1.0f;
  closures_add_principled(list, g, 1.0f, p);
  CHECK(list.count == 1u);
  CHECK(closure_type(list.at[0]) == HW_CLOSURE_DIFFUSE);
  CHECK(list.at[0].weight.x == doctest::Approx(0.8));  // nothing taken away by layers that are not there
  ClosureList glass;
  closures_add_glass(glass, g, 1.0f, vec3(1.0f), 0.3f, 1.5f, kN, 1u);
  REQUIRE(glass.count == 1u);
  stratified(8, 4u, [&](vec3 u) { CHECK((closures_sample(glass, g, u).label & HW_LABEL_REFLECT) == 0u); });
  g.flags |= HW_SHADE_NO_REFRACTIVE_CAUSTICS;
  ClosureList none;
  closures_add_glass(none, g, 1.0f, vec3(1.0f), 0.3f, 1.5f, kN, 1u);
  closures_add_refraction(none, g, 1.0f, vec3(1.0f), 0.3f, 1.5f, kN);
  CHECK(none.count == 0u);
}

TEST_CASE("nothing is ever NaN, infinite or negative") {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> u(0.0f, 1.0f);
  auto extreme = [&](std::initializer_list<float> values) {
    const float* v = values.begin();
    const size_t i = size_t(u(random) * (values.size() + 1));
    return i < values.size() ? v[i] : u(random);
  };
  std::normal_distribution<float> d;
  for (int i = 0; i < 20000; ++i) {
    ShadingGeometry g = geometry(extreme({1.0f, 1e-4f, 1e-7f, 0.0f}), 6.28f * u(random));
    g.flags = uint(u(random) * 16.0f);
    if (u(random) < 0.5f) g.Ns = normalize(kN + 0.4f * vec3(d(random), d(random), d(random)));
    PrincipledInputs p = principled();
    const vec3 N = u(random) < 0.5f ? g.Ns : normalize(g.Ns + 0.8f * vec3(d(random), d(random), d(random)));
    p.base_color = vec3(extreme({0.0f, 1.0f, 50.0f, -1.0f}), extreme({0.0f, 1.0f}), u(random));
    p.metallic = extreme({0.0f, 1.0f, 3.0f});
    p.roughness = extreme({0.0f, 1e-3f, 4e-3f, 1.0f, -1.0f, 7.0f});
    p.ior = extreme({1.0f, 0.0f, 1.00001f, 1.5f, 100.0f, -2.0f});
    p.alpha = extreme({0.0f, 1.0f, 2.0f, 1e-6f});
    p.normal = N;
    p.coat_normal = g.Ns;
    p.diffuse_roughness = extreme({0.0f, 1.0f});
    p.specular_ior_level = extreme({0.0f, 0.5f, 1.0f, 40.0f});
    p.specular_tint = vec3(extreme({0.0f, 1.0f, 9.0f}));
    p.anisotropic = extreme({0.0f, 1.0f});
    p.tangent = u(random) < 0.3f ? vec3(extreme({0.0f})) : N;
    p.transmission_weight = extreme({0.0f, 1.0f});
    p.coat_weight = extreme({0.0f, 1.0f, 2.0f});
    p.coat_roughness = extreme({0.0f, 1.0f});
    p.coat_ior = extreme({1.0f, 4.0f});
    p.coat_tint = vec3(extreme({0.0f, 1.0f}));
    p.sheen_weight = extreme({0.0f, 1.0f});
    p.sheen_roughness = extreme({0.0f, 1.0f});
    p.multiscatter = u(random) < 0.5f;
    ClosureList list;
    const vec3 emission = closures_add_principled(list, g, extreme({1.0f, 0.0f, 1e-6f}), p);
    closures_finish(list);
    CHECK(finite(emission));
    for (uint k = 0; k < list.count; ++k) {
      CHECK(finite(list.at[k].weight));
      CHECK(finite(closure_albedo(list.at[k], g.wo, true, true)));
      CHECK(list.at[k].sample_weight > 0.0f);
    }
    const BsdfSample s = closures_sample(list, g, vec3(extreme({0.0f, 0.99999994f}), extreme({0.0f, 0.99999994f}), extreme({0.0f, 0.99999994f})));
    if (s.label != HW_LABEL_NONE) {
      CHECK(finite(s.wi));
      CHECK(finite(bsdf_value_total(s.value)));
      CHECK(std::isfinite(s.value.pdf));
      CHECK(s.value.pdf > 0.0f);
      CHECK(std::min({bsdf_value_total(s.value).x, bsdf_value_total(s.value).y, bsdf_value_total(s.value).z}) >= 0.0f);
    }
    const BsdfValue v = closures_eval(list, g, normalize(vec3(d(random), d(random), extreme({0.0f, 1e-6f, -1e-6f}))));
    CHECK(finite(bsdf_value_total(v)));
    CHECK(std::isfinite(v.pdf));
    CHECK(v.pdf >= 0.0f);
  }
}

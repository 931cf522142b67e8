// SPDX-License-Identifier: Apache-2.0
// Closures against themselves: energy, reciprocity, deltas, switches, no NaN. What they should be is the matter of
// test_closure_reference.cpp; how they are sampled, of test_closure_sampling.cpp.
#include <doctest/doctest.h>

#include <cstring>
#include <span>

#include "closure_cases.h"
#include "materials/luts.h"

using namespace hw;
using namespace hw::closure_test;

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

// Every cell that a look-up can fall in holds its corners: GLSL reads these words where C++ reads the table.
TEST_CASE("words of the albedo tables hold the tables' cells") {
  const std::span<const float> table = albedo_lut_table();
  const std::vector<std::uint64_t> words = albedo_lut_words();
  REQUIRE(words.size() == HW_LUT_COUNT);
  const auto corner = [&](std::size_t i, int c) { return float(words[i] >> (16 * c) & 0xFFFF) / 65535.0f; };
  const auto wrong_cells = [&](std::uint32_t first, std::uint32_t n, std::uint32_t rows) {
    int wrong = 0;
    for (std::uint32_t y = 0; y < rows; ++y)
      for (std::uint32_t x = 0; x + 1 < n; ++x) {
        const std::size_t i = first + y * n + x;
        wrong += corner(i, 0) != table[i] || corner(i, 1) != table[i + 1];
        if (y % n + 1 < n && rows > 1) wrong += corner(i, 2) != table[i + n] || corner(i, 3) != table[i + n + 1];
      }
    return wrong;
  };
  CHECK(wrong_cells(HW_LUT_E, 32, 32) == 0);
  CHECK(wrong_cells(HW_LUT_E_MEAN, 32, 1) == 0);
  for (std::uint32_t first : {HW_LUT_GLASS, HW_LUT_GLASS_INV, HW_LUT_RISE_IOR}) CHECK(wrong_cells(first, 16, 256) == 0);
  for (std::uint32_t first : {HW_LUT_GLASS_MEAN, HW_LUT_GLASS_INV_MEAN, HW_LUT_RISE_SCHLICK})
    CHECK(wrong_cells(first, 16, 16) == 0);
  for (std::size_t i = HW_LUT_SHEEN; i + 1 < HW_LUT_COUNT; ++i) {
    float pair[2];
    std::memcpy(pair, &words[i], 8);
    if (pair[0] != table[i] || pair[1] != table[i + 1]) FAIL_CHECK("sheen word ", i);
  }
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
      [](auto& l, auto& g) {
        closures_add_metallic_f82(l, g, 1.0f, vec3(0.7f), vec3(0.3f), 0.5f, 0.4f, 0.1f, kN, kX, 0u);
      },
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
    const vec3 to_below = vec3(below.wo.x, below.wo.y, -below.wo.z),
               to_above = vec3(above.wo.x, above.wo.y, -above.wo.z);
    ClosureList from_above, from_below;
    closures_add_glass(from_above, above, 1.0f, vec3(1.0f), 0.6f, 1.5f, kN, 0u);
    closures_add_glass(from_below, below, 1.0f, vec3(1.0f), 0.6f, 1.5f, kN, 0u);
    const float down = bsdf_value_total(closures_eval(from_above, above, to_below)).x / below.wo.z;
    const float up = bsdf_value_total(closures_eval(from_below, below, to_above)).x / above.wo.z;
    // f(a, b) / n_b^2 = f(b, a) / n_a^2, light arriving from b.
    CHECK(down / (1.5f * 1.5f) == doctest::Approx(up).epsilon(2e-3));
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
    const BsdfSample s = closures_sample(
        list, g, vec3(extreme({0.0f, 0.99999994f}), extreme({0.0f, 0.99999994f}), extreme({0.0f, 0.99999994f})));
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

// SPDX-License-Identifier: Apache-2.0
// The light table, its odds, and the environment's distribution.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "lib/sampler.h"
#include "lib/warp.h"
#include "lib/world_sampling.h"
#include "lights/alias_table.h"
#include "lights/light_table.h"
#include "lights/world_distribution.h"
#include "shared/light_kinds.h"

using namespace hw;

namespace {

constexpr double kPi = 3.14159265358979323846;
const Matrix34 kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

// Probability of each entry by the table's thresholds.
std::vector<double> odds(const std::vector<AliasEntry>& t) {
  std::vector<double> p(t.size(), 0);
  for (std::size_t i = 0; i < t.size(); ++i) {
    p[i] += t[i].threshold / double(t.size());
    p[t[i].alias] += (1.0 - t[i].threshold) / double(t.size());
  }
  return p;
}

LightData lamp(std::uint32_t type, const char* name, float power = 10) {
  LightData d;
  d.name = name;
  d.type = type;
  d.object_to_world = kIdentity;
  d.power = power;
  d.radius = 0.1f;
  return d;
}

MaterialRecord material(vec3 emission, std::uint32_t flags) {
  MaterialRecord m{};
  m.emission = emission;
  m.flags = flags;
  return m;
}

// Two triangles of area 1/2, front towards +z.
const std::vector<float> kQuad{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
const std::vector<std::uint32_t> kQuadTriangles{0, 1, 2, 0, 2, 3};

}  // namespace

TEST_CASE("an alias table has the odds of its weights") {
  std::mt19937 random(1);
  for (const std::size_t n : {1u, 2u, 3u, 17u, 1000u, 100000u}) {
    std::vector<float> w(n);
    for (float& v : w) v = std::exp(std::uniform_real_distribution<float>(-12, 12)(random));
    for (std::size_t i = 0; i + 1 < n; i += 5) w[i] = 0;
    const std::vector<AliasEntry> t = build_alias_table(w);
    REQUIRE(t.size() == n);
    double sum = 0;
    for (float v : w) sum += v;
    const std::vector<double> p = odds(t);
    double worst = 0, total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      CHECK(t[i].alias < n);
      worst = std::max(worst, std::abs(p[i] - w[i] / sum));
      total += t[i].pdf;
      REQUIRE(t[i].pdf == doctest::Approx(p[i]).epsilon(1e-6));
      if (w[i] == 0) REQUIRE(p[i] == 0);
      if (w[i] > 0) REQUIRE(p[i] > 0);
    }
    CHECK(worst < 1e-6);
    CHECK(total == doctest::Approx(1).epsilon(1e-5));
  }
  CHECK(build_alias_table({}).empty());
  const std::vector<float> none(3, 0.0f);
  for (const AliasEntry& e : build_alias_table(none)) CHECK(e.pdf == 0);
}

TEST_CASE("choosing by an alias table gives its frequencies") {
  const std::vector<float> w{1, 0, 3, 0.5f, 10, 0, 2.5f};
  const std::vector<AliasEntry> t = build_alias_table(w);
  std::vector<double> count(w.size(), 0);
  constexpr uint kDraws = 1u << 16;
  for (uint i = 0; i < kDraws; ++i) {
    const float u = sampler_1d(3, i, 0, 0) * float(t.size());
    const uint k = std::min(uint(u), uint(t.size() - 1));
    count[u - float(k) < t[k].threshold ? k : t[k].alias] += 1;
  }
  for (std::size_t i = 0; i < w.size(); ++i) CHECK(count[i] / kDraws == doctest::Approx(w[i] / 17).epsilon(0.002));
}

TEST_CASE("the light table has lamps, suns, world and triangles in order") {
  const std::vector<LightData> lamps{lamp(HW_LIGHT_SUN, "sun a"), lamp(HW_LIGHT_POINT, "point"),
                                     lamp(HW_LIGHT_AREA, "area"), lamp(HW_LIGHT_SUN, "sun b"),
                                     lamp(HW_LIGHT_SPOT, "spot")};
  const std::vector<MaterialRecord> materials{material(vec3(0), 0), material(vec3(2, 4, 6), HW_MATERIAL_EMISSIVE),
                                              material(vec3(1), HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMIT_BACK)};
  const std::vector<std::uint32_t> slots{0, 1, 2};
  const std::vector<std::uint8_t> first{1, 0}, second{2, 2};
  std::vector<EmissiveInstance> instances(2);
  instances[0] = {"a", 7, {2, 0, 0, 5, 0, 2, 0, 0, 0, 0, 2, 0}, kQuad, kQuadTriangles, first, slots, HW_LIGHT_CAMERA};
  instances[1] = {"mirrored", 9, {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, kQuad, kQuadTriangles, second, slots, 0};
  LightTableInput input;
  input.lamps = lamps;
  input.instances = instances;
  input.materials = materials;
  input.world = {true, {0.5f, 0.5f, 0.5f}, 3, HW_LIGHT_CAMERA};
  input.scene_radius = 4;
  const LightTable t = build_light_table(input);

  REQUIRE(t.lights.size() == 10);
  CHECK(t.alias.size() == 10);
  CHECK(t.shapes.size() == 5);
  CHECK(t.warnings.empty());
  CHECK(t.lamp_count == 5);
  CHECK(t.sun_offset == 3);
  CHECK(t.sun_count == 2);
  CHECK(t.lamp_index == std::vector<std::uint32_t>{3, 0, 1, 4, 2});
  for (std::uint32_t i = 0; i < 5; ++i) CHECK(t.lights[i].primitive == i);
  CHECK(t.lights[4].type == HW_LIGHT_SUN);
  CHECK(t.shapes[3].shape == HW_LAMP_SHAPE_NONE);
  CHECK(t.shapes[0].shape == HW_LAMP_SHAPE_SPHERE);
  CHECK(t.shapes[1].shape == HW_LAMP_SHAPE_RECTANGLE);
  CHECK(t.world_light == 5);
  CHECK(t.lights[5].type == HW_LIGHT_WORLD);
  CHECK(t.weights[5] == doctest::Approx(4 * kPi * 0.5 * kPi * 16));
  CHECK(t.weights[0] == doctest::Approx(10));  // the flux of a point is its power
  CHECK(t.weights[3] == doctest::Approx(10 * kPi * 16));
  CHECK(t.instance_offset == std::vector<std::uint32_t>{6, 8});

  const LightRecord& lit = t.lights[6];
  CHECK(lit.type == HW_LIGHT_TRIANGLE);
  CHECK(lit.instance == 7);
  CHECK(lit.primitive == 0);
  CHECK(lit.area == doctest::Approx(2));
  CHECK(lit.position.x == doctest::Approx(5));
  CHECK(lit.emission.y == 4);
  CHECK(lit.axis_z.z == doctest::Approx(1));
  CHECK((lit.flags & HW_LIGHT_TWO_SIDED) != 0);
  CHECK((lit.flags & HW_LIGHT_CAMERA) != 0);
  CHECK(t.weights[6] == doctest::Approx(2 * kPi * 2 * 4));
  CHECK(t.weights[7] == 0);  // a slot that does not emit
  CHECK(t.alias[7].pdf == 0);
  // Mirrored: the front still faces +z in the world after the mirror, and only the back is sampled.
  CHECK(t.lights[8].axis_z.z == doctest::Approx(-1));
  CHECK((t.lights[8].flags & HW_LIGHT_TWO_SIDED) == 0);
  CHECK(t.weights[8] == doctest::Approx(kPi * 0.5));
  for (std::size_t i = 0; i < 10; ++i) CHECK((t.alias[i].pdf > 0) == (t.weights[i] > 0));

  input.selection = LightSelection::kUniform;
  const LightTable u = build_light_table(input);
  for (std::size_t i = 0; i < 10; ++i) CHECK(u.alias[i].pdf == doctest::Approx(u.weights[i] > 0 ? 1.0 / 9 : 0));
}

TEST_CASE("bad lamps get no weight and are named") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  std::vector<LightData> lamps;
  const auto add = [&](const char* name, auto&& edit) {
    lamps.push_back(lamp(HW_LIGHT_AREA, name));
    edit(lamps.back());
  };
  add("good", [](LightData&) {});
  add("zero", [](LightData& d) { d.power = 0; });
  add("negative", [](LightData& d) { d.power = -5; });
  add("nan", [&](LightData& d) { d.power = nan; });
  add("infinite", [&](LightData& d) { d.power = inf; });
  add("black", [](LightData& d) { d.color = {0, 0, 0}; });
  add("nan colour", [&](LightData& d) { d.color[1] = nan; });
  add("flat", [](LightData& d) { d.object_to_world[0] = 0; });
  add("nan matrix", [&](LightData& d) { d.object_to_world[3] = nan; });
  add("no size", [](LightData& d) { d.size_x = 0; });
  add("nan size", [&](LightData& d) { d.size_x = nan; });
  add("flat spot",
      [](LightData& d) { d.type = HW_LIGHT_SPOT, d.object_to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}; });
  add("flat sun", [](LightData& d) { d.type = HW_LIGHT_SUN, d.object_to_world = {}; });
  add("too strong", [](LightData& d) { d.power = 3e38f, d.size_x = 1e-10f; });
  LightTableInput input;
  input.lamps = lamps;
  const LightTable t = build_light_table(input);
  CHECK(t.warnings.size() == lamps.size() - 1);
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    CAPTURE(lamps[i].name);
    const LightRecord& r = t.lights[t.lamp_index[i]];
    const bool good = lamps[i].name == "good";
    CHECK((t.weights[t.lamp_index[i]] > 0) == good);
    CHECK((t.alias[t.lamp_index[i]].pdf > 0) == good);
    CHECK((r.emission.x + r.emission.y + r.emission.z > 0) == good);
    CHECK(std::isfinite(r.position.x + r.axis_x.x + r.axis_y.x + r.axis_z.x));
    const bool named = std::any_of(t.warnings.begin(), t.warnings.end(),
                                   [&](const LightWarning& w) { return w.name == lamps[i].name && !w.reason.empty(); });
    CHECK(named != good);
  }
  LightData hidden = lamp(HW_LIGHT_POINT, "no MIS");
  CHECK(make_lamp(hidden, 1).shape.shape == HW_LAMP_SHAPE_SPHERE);
  hidden.flags &= ~HW_LIGHT_USE_MIS;
  CHECK(make_lamp(hidden, 1).shape.shape == HW_LAMP_SHAPE_NONE);
  CHECK(make_lamp(hidden, 1).flux > 0);
  const LightTable empty = build_light_table({});
  CHECK(empty.lights.empty());
  CHECK(empty.total_weight == 0);
}

TEST_CASE("bad meshes are refused or left out, by name") {
  const std::vector<MaterialRecord> materials{material(vec3(1), HW_MATERIAL_EMISSIVE)};
  const std::vector<std::uint32_t> slots{0}, beyond{0, 1, 9}, wrong_material{5};
  const std::vector<std::uint8_t> short_slots{0};
  std::vector<EmissiveInstance> instances(1);
  instances[0] = {"lantern", 0, kIdentity, kQuad, beyond, {}, slots, 0};
  LightTableInput input;
  input.instances = instances;
  input.materials = materials;
  const auto fails = [&] {
    try {
      build_light_table(input);
    } catch (const SceneError& e) {
      return std::string(e.what()).find("lantern") != std::string::npos;
    }
    return false;
  };
  CHECK(fails());
  instances[0] = {"lantern", 0, kIdentity, kQuad, kQuadTriangles, {}, wrong_material, 0};
  CHECK(fails());
  instances[0] = {"lantern", 0, kIdentity, kQuad, kQuadTriangles, short_slots, slots, 0};
  CHECK(fails());
  std::vector<float> broken = kQuad;
  broken[3] = std::numeric_limits<float>::quiet_NaN();
  instances[0] = {"lantern", 0, kIdentity, broken, kQuadTriangles, {}, slots, 0};
  const LightTable t = build_light_table(input);
  CHECK(t.weights[0] == 0);
  CHECK(t.weights[1] > 0);
  REQUIRE(t.warnings.size() == 1);
  CHECK(t.warnings[0].name == "lantern");
}

// What kernels hold of light sampling hangs on these bits (shared/light_kinds.h).
TEST_CASE("the kinds of light of a table, and what updates make of them") {
  const auto kinds_of = [](std::vector<LightData> lamps, bool world = false) {
    LightTableInput input;
    input.lamps = lamps;
    input.world.emits = world;
    return build_light_table(input).kinds;
  };
  const auto with = [](std::uint32_t type, auto&& edit) {
    LightData d = lamp(type, "lamp");
    edit(d);
    return std::vector<LightData>{d};
  };
  const auto plain = [](LightData&) {};
  const auto soft = [](LightData& d) { d.flags |= HW_LIGHT_SOFT_FALLOFF; };
  CHECK(kinds_of({}) == 0);
  CHECK(kinds_of({}, true) == HW_KIND_WORLD);
  CHECK(kinds_of(with(HW_LIGHT_POINT, plain)) == (HW_KIND_POINT | HW_KIND_BALL));
  CHECK(kinds_of(with(HW_LIGHT_POINT, soft)) == HW_KIND_POINT);
  CHECK(kinds_of(with(HW_LIGHT_SPOT, plain)) == (HW_KIND_POINT | HW_KIND_SPOT | HW_KIND_BALL));
  CHECK(kinds_of(with(HW_LIGHT_SPOT, soft)) == (HW_KIND_POINT | HW_KIND_SPOT));
  CHECK(kinds_of(with(HW_LIGHT_SUN, plain)) == HW_KIND_SUN);
  CHECK(kinds_of(with(HW_LIGHT_AREA, plain)) == HW_KIND_AREA);
  CHECK(kinds_of(with(HW_LIGHT_AREA, [](LightData& d) { d.ellipse = true; })) == (HW_KIND_AREA | HW_KIND_ELLIPSE));
  CHECK(kinds_of(with(HW_LIGHT_AREA, [](LightData& d) { d.spread = 0.5f; })) == (HW_KIND_AREA | HW_KIND_SPREAD));
  CHECK(kinds_of({lamp(HW_LIGHT_SUN, "s"), lamp(HW_LIGHT_AREA, "a")}, true) ==
        (HW_KIND_SUN | HW_KIND_AREA | HW_KIND_WORLD));

  const std::vector<MaterialRecord> materials{material(vec3(1), HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMISSION_SHADER)};
  const std::vector<std::uint32_t> slots{0};
  const std::vector<float> radiance{1, 1};
  const std::vector<std::uint32_t> maps{HW_NONE, 0};
  std::vector<LightData> lamps{lamp(HW_LIGHT_AREA, "a")};
  std::vector<EmissiveInstance> instances(2);
  for (std::uint32_t i = 0; i < 2; ++i) instances[i] = {"q", i, kIdentity, kQuad, kQuadTriangles, {}, slots, 0};
  instances[1].radiance = radiance;
  instances[1].maps = maps;
  instances[1].maps_at = 1;
  LightTableInput input;
  input.lamps = lamps;
  input.instances = instances;
  input.materials = materials;
  LightTable t = build_light_table(input);
  CHECK(t.kinds == (HW_KIND_AREA | HW_KIND_TRIANGLE | HW_KIND_TRIANGLE_MAP));
  lamps[0].ellipse = true;
  instances[1].maps = {};
  update_light_table(t, input, std::vector<std::uint32_t>{1});
  CHECK(t.kinds == (HW_KIND_AREA | HW_KIND_ELLIPSE | HW_KIND_TRIANGLE));
  lamps[0].ellipse = false;
  instances[1].maps = maps;
  update_light_table(t, input, std::vector<std::uint32_t>{1});
  CHECK(t.kinds == (HW_KIND_AREA | HW_KIND_TRIANGLE | HW_KIND_TRIANGLE_MAP));
}

TEST_CASE("an update equals a new table") {
  std::vector<LightData> lamps{lamp(HW_LIGHT_POINT, "p"), lamp(HW_LIGHT_SUN, "s")};
  const std::vector<MaterialRecord> materials{material(vec3(1), HW_MATERIAL_EMISSIVE)};
  const std::vector<std::uint32_t> slots{0};
  std::vector<EmissiveInstance> instances(3);
  for (std::uint32_t i = 0; i < 3; ++i) instances[i] = {"q", i, kIdentity, kQuad, kQuadTriangles, {}, slots, 0};
  LightTableInput input;
  input.lamps = lamps;
  input.instances = instances;
  input.materials = materials;
  LightTable t = build_light_table(input);
  instances[1].object_to_world = {0, -3, 0, 1, 3, 0, 0, 2, 0, 0, 3, 3};
  lamps[0].object_to_world[3] = 8;
  lamps[1].power = 99;
  update_light_table(t, input, std::vector<std::uint32_t>{1});
  const LightTable fresh = build_light_table(input);
  REQUIRE(t.lights.size() == fresh.lights.size());
  for (std::size_t i = 0; i < t.lights.size(); ++i) {
    CHECK(std::memcmp(&t.lights[i], &fresh.lights[i], sizeof(LightRecord)) == 0);
    CHECK(std::memcmp(&t.alias[i], &fresh.alias[i], sizeof(AliasEntry)) == 0);
  }
  lamps[0].type = HW_LIGHT_SUN;
  CHECK_THROWS_AS(update_light_table(t, input, {}), SceneError);
  input.lamps = {};
  CHECK_THROWS_AS(update_light_table(t, input, {}), SceneError);
}

TEST_CASE("a million emissive triangles are tabled quickly") {
  constexpr std::uint32_t kSide = 724;  // 2 * 723^2 = 1.05 M triangles
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) positions.insert(positions.end(), {float(x), float(y), float(x * y % 7)});
  }
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t v = y * kSide + x;
      triangles.insert(triangles.end(), {v, v + 1, v + kSide, v + 1, v + kSide + 1, v + kSide});
    }
  }
  const std::vector<MaterialRecord> materials{material(vec3(1), HW_MATERIAL_EMISSIVE)};
  const std::vector<std::uint32_t> slots{0};
  std::vector<EmissiveInstance> instances(1);
  instances[0] = {"grid", 0, kIdentity, positions, triangles, {}, slots, 0};
  LightTableInput input;
  input.instances = instances;
  input.materials = materials;
  const auto start = std::chrono::steady_clock::now();
  const LightTable t = build_light_table(input);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  MESSAGE("1.05 M triangles: " << seconds << " s");
  CHECK(t.lights.size() == triangles.size() / 3);
  CHECK(seconds < 5);  // far above what it takes; sanitizers and shared machines are slow
  double sum = 0;
  for (const AliasEntry& e : t.alias) sum += e.pdf;
  CHECK(sum == doctest::Approx(1).epsilon(1e-4));
}

TEST_CASE("equirectangular mapping is Cycles' and inverts") {
  const auto near = [](vec2 a, vec2 b) { return std::abs(a.x - b.x) < 1e-6f && std::abs(a.y - b.y) < 1e-6f; };
  CHECK(near(equirect_from_direction(vec3(1, 0, 0)), vec2(0.5f, 0.5f)));
  CHECK(near(equirect_from_direction(vec3(0, 1, 0)), vec2(0.25f, 0.5f)));
  CHECK(near(equirect_from_direction(vec3(0, -1, 0)), vec2(0.75f, 0.5f)));
  CHECK(near(equirect_from_direction(vec3(0, 0, 1)), vec2(0.5f, 1.0f)));
  std::mt19937 engine(2);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const vec3 d = warp_sphere(vec2(uniform(engine), uniform(engine)));
    CHECK(glm::length(equirect_to_direction(equirect_from_direction(d)) - d) < 2e-6f);
  }
}

TEST_CASE("the environment is sampled by its brightness, with an exact pdf") {
  for (const bool compensate : {false, true}) {
    constexpr std::uint32_t kWidth = 32, kHeight = 16;
    std::mt19937 engine(5);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<float> values(kWidth * kHeight);
    for (float& v : values) v = uniform(engine) < 0.2f ? 0.0f : uniform(engine);
    values[5 * kWidth + 9] = 200;  // a sun
    values[0] = std::numeric_limits<float>::quiet_NaN();
    values[1] = -4;
    const WorldTables t = build_world_distribution(values.data(), kWidth, kHeight, compensate);
    const WorldDistribution w = t.host();
    REQUIRE(w.total > 0);
    // pdf integrates to 1, and every cell is drawn as often as its pdf says.
    std::vector<double> count(values.size(), 0), expected(values.size(), 0);
    double sum = 0;
    constexpr uint kDirections = 1u << 18;
    for (uint i = 0; i < kDirections; ++i) {
      const vec2 u = sampler_2d(1, i, 0, 0);
      const float pdf = world_pdf(w, warp_sphere(u));
      sum += pdf * 4 * kPi / kDirections;
      vec3 wi;
      float drawn;
      world_sample(w, sampler_2d(1, i, 1, 0), wi, drawn);
      REQUIRE(drawn > 0);
      REQUIRE(glm::length(wi) == doctest::Approx(1));
      const vec2 uv = equirect_from_direction(wi);
      const auto cell = std::min(std::uint32_t(uv.x * kWidth), kWidth - 1) +
                        kWidth * std::min(std::uint32_t(uv.y * kHeight), kHeight - 1);
      count[cell] += 1.0 / kDirections;
    }
    CHECK(sum == doctest::Approx(1).epsilon(0.01));
    double total = 0;
    const double offset = compensate ? t.mean : 0;
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      const double area = std::cos(kPi * y / kHeight) - std::cos(kPi * (y + 1) / kHeight);
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const float v = values[y * kWidth + x];
        total += expected[y * kWidth + x] = v > 0 ? std::max(0.0, v - offset) * area : 0;
      }
    }
    for (std::size_t i = 0; i < values.size(); ++i) CHECK(std::abs(count[i] - expected[i] / total) < 5e-4);
  }
}

TEST_CASE("environments with nothing to sample, and constant ones") {
  const std::vector<float> black(8, 0.0f), grey(8 * 4, 0.25f);
  CHECK(build_world_distribution(black.data(), 4, 2).record.total == 0);
  CHECK(build_world_distribution(nullptr, 0, 0).record.total == 0);
  vec3 wi;
  float pdf;
  const WorldTables none = build_world_distribution(black.data(), 4, 2);
  world_sample(none.host(), vec2(0.5f), wi, pdf);
  CHECK(pdf == 0);
  CHECK(world_pdf(none.host(), vec3(0, 0, 1)) == 0);
  for (const bool compensate : {false, true}) {
    const WorldTables t = build_world_distribution(grey.data(), 8, 4, compensate);
    CHECK(t.mean == doctest::Approx(0.25));
    for (uint i = 0; i < 64; ++i) {
      world_sample(t.host(), sampler_2d(0, i, 0, 0), wi, pdf);
      CHECK(pdf == doctest::Approx(1 / (4 * kPi)));
      CHECK(world_pdf(t.host(), wi) == doctest::Approx(1 / (4 * kPi)));
    }
  }
}

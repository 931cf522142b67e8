// SPDX-License-Identifier: Apache-2.0
// Emission maps: frequencies against densities, on the square and as pdf of a triangle light from anywhere; what is
// made of bad measurements; and the tables' part: what is measured when, and who shares it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "light_cases.h"
#include "lights/emission_map.h"
#include "table_rig.h"

using namespace hw;
using namespace hw::light_test;

namespace {

// n * n cells: dark, but for a bright corner, a stripe and some noise.
std::vector<float> neon_sign(std::uint32_t n) {
  Random random(n);
  std::vector<float> cells(std::size_t{n} * n, 0.0f);
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      if (x < n / 4 && y >= n / 2) cells[y * n + x] = 20 + random();
      if (y == 1) cells[y * n + x] += 3;
      if ((x * 7 + y * 3) % 11 == 0) cells[y * n + x] += random();
    }
  }
  return cells;
}

std::uint64_t address(const std::vector<float>& maps) { return reinterpret_cast<std::uint64_t>(maps.data()); }

// Sum of (seen - expected)^2 / expected over bins of which at least five are expected, in units of its own spread.
double chi_square(const std::vector<double>& seen, const std::vector<double>& expected) {
  double sum = 0;
  int bins = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (expected[i] < 5) continue;
    sum += (seen[i] - expected[i]) * (seen[i] - expected[i]) / expected[i];
    ++bins;
  }
  return (sum - bins) / std::sqrt(2.0 * std::max(bins, 1));
}

}  // namespace

TEST_CASE("emission maps: frequencies are those of the density, which integrates to one") {
  for (const std::uint32_t n : {1u, 3u, 8u, 64u}) {
    CAPTURE(n);
    std::vector<float> maps(17, -1.0f);  // another stands before it
    const std::uint32_t map = append_emission_map(neon_sign(n), n, maps);
    REQUIRE(map == 17);
    REQUIRE(maps.size() == 17 + emission_map_floats(n));
    Random random(7);
    std::vector<double> seen(std::size_t{n} * n), expected(std::size_t{n} * n);
    constexpr int kSamples = 200000;
    int wrong = 0;
    for (int i = 0; i < kSamples; ++i) {
      float density;
      const vec2 at = emission_map_sample(address(maps), map, vec2(random(), random()), density);
      REQUIRE((at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1));
      const auto x = std::min(static_cast<std::uint32_t>(at.x * float(n)), n - 1);
      const auto y = std::min(static_cast<std::uint32_t>(at.y * float(n)), n - 1);
      ++seen[y * n + x];
      wrong += std::abs(emission_map_density(address(maps), map, at) - density) > 1e-5f * density;
    }
    CHECK(wrong < kSamples / 10000);  // on the line between two cells
    double total = 0, least = 1e30;
    for (std::uint32_t i = 0; i < n * n; ++i) {
      const vec2 middle((float(i % n) + 0.5f) / float(n), (float(i / n) + 0.5f) / float(n));
      const double density = emission_map_density(address(maps), map, middle);
      expected[i] = density / (n * n) * kSamples;
      total += density / (n * n);
      least = std::min(least, density);
    }
    CHECK(total == doctest::Approx(1).epsilon(1e-5));
    CHECK(least > 0.5 / 32);  // nothing is out of reach
    CHECK(std::abs(chi_square(seen, expected)) < 5);
  }
}

TEST_CASE("emission maps: what is negative, infinite or no number counts as dark, and dark everywhere as even") {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), -3.0f, std::numeric_limits<float>::infinity(), 4.0f};
  CHECK(emission_mean(bad) == 1.0f);
  CHECK(emission_varies(bad));
  std::vector<float> maps;
  std::uint32_t map = append_emission_map(bad, 2, maps);
  CHECK(emission_map_density(address(maps), map, vec2(0.75f, 0.75f)) > 3.5f);
  CHECK(emission_map_density(address(maps), map, vec2(0.25f, 0.25f)) > 0.02f);
  const float dark[] = {0, 0, 0, 0};
  CHECK_FALSE(emission_varies(dark));
  map = append_emission_map(dark, 2, maps);
  for (const vec2 at : {vec2(0.1f), vec2(0.9f, 0.2f)}) CHECK(emission_map_density(address(maps), map, at) == 1.0f);
}

TEST_CASE("the map from square to triangle has its inverse") {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const vec2 u(random(), random());
    CHECK(length(triangle_unwarp_area(triangle_warp_area(u)) - u) < 1e-6f);
  }
}

TEST_CASE("triangle lights with a map: frequencies are those of the pdf, seen from anywhere") {
  Random random(3);
  std::vector<float> maps;
  append_emission_map(neon_sign(8), 8, maps);
  const std::uint32_t map = append_emission_map(neon_sign(16), 16, maps);
  for (int round = 0; round < 24; ++round) {
    CAPTURE(round);
    const bool two_sided = round % 2 == 1;
    LightRecord light = triangle(vec3(0), vec3(1.3f, 0.1f, 0), vec3(0.2f, 1, 0.3f), vec3(1), two_sided);
    light.emission_map = map;
    const LightCase c{"", light, 1};
    const vec3 P = receiver(c, round / 2 % 3, random);
    constexpr int kSamples = 60000, kBins = 8;
    std::vector<double> seen(kBins * kBins), expected(kBins * kBins);
    const auto bin = [](vec2 uv) {
      const vec2 at = triangle_unwarp_area(uv);
      return std::min(int(at.y * kBins), kBins - 1) * kBins + std::min(int(at.x * kBins), kBins - 1);
    };
    int wrong = 0, drawn = 0;
    for (int i = 0; i < kSamples; ++i) {
      LightSample s;
      if (!light_sample(light, address(maps), P, vec3(random(), random(), 0), s)) continue;
      ++drawn;
      ++seen[bin(s.uv)];
      wrong += !(std::abs(light_pdf(light, address(maps), P, s.wi, s.distance, s.uv) - s.pdf) < 2e-3f * s.pdf);
    }
    if (drawn == 0) continue;
    CHECK(drawn == kSamples);
    CHECK(wrong < kSamples / 1000);
    // The pdf over each bin, by points even over the triangle: solid angle of an area is density of light_point.
    constexpr int kFine = 64;
    double total = 0;
    for (int i = 0; i < kBins * kFine * kBins * kFine; ++i) {
      const vec2 u((float(i % (kBins * kFine)) + 0.5f) / (kBins * kFine),
                   (float(i / (kBins * kFine)) + 0.5f) / (kBins * kFine));
      const vec2 uv = triangle_warp_area(u);
      const LightPoint p = light_point(light, uv, P);
      const double share = double(light_pdf(light, address(maps), P, p.wi, p.distance, uv)) * p.density /
                           (kBins * kFine * kBins * kFine);
      expected[bin(uv)] += share * kSamples;
      total += share;
    }
    CHECK(total == doctest::Approx(1).epsilon(0.01));
    CHECK(std::abs(chi_square(seen, expected)) < 8);  // bins cut off by the sphere are only as exact as their points
  }
}

TEST_CASE("a triangle's map takes the noise out of its light") {
  // What it is for: a dark sign with a bright corner, from near and far, by the map and without it.
  std::vector<float> maps;
  const std::vector<float> cells = neon_sign(16);
  append_emission_map(neon_sign(8), 8, maps);
  const std::uint32_t map = append_emission_map(cells, 16, maps);
  LightRecord light = triangle(vec3(0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(1), true);
  const auto emission = [&](vec2 uv) {
    const vec2 at = triangle_unwarp_area(uv);
    return cells[std::min(int(at.y * 16), 15) * 16 + std::min(int(at.x * 16), 15)];
  };
  Random random(5);
  for (const vec3 P : {vec3(0.3f, 0.2f, 0.4f), vec3(0.2f, 0.5f, 2), vec3(3, 2, 10)}) {
    Mean mean[2];
    for (int by_map = 0; by_map < 2; ++by_map) {
      light.emission_map = by_map ? map : 0;
      for (int i = 0; i < 100000; ++i) {
        LightSample s;
        REQUIRE(light_sample(light, address(maps), P, vec3(random(), random(), 0), s));
        mean[by_map].add(emission(s.uv) / s.pdf);
      }
    }
    CHECK(std::abs(mean[0].mean() - mean[1].mean()) < 5 * std::hypot(mean[0].error(), mean[1].error()));
    CHECK(mean[1].error() < 0.5 * mean[0].error());
  }
}

namespace {

using namespace hw::table_rig;

MaterialData varying() { return material(HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMISSION_SHADER); }

// Answers for the stage until nothing is wanted: the first of every two triangles is bright in one cell. Returns how
// often it was asked.
int answer(Tables& tables) {
  int rounds = 0;
  while (const EmissionGrid* grid = tables.emission_wanted()) {
    const std::size_t cells = std::size_t{grid->size} * grid->size;
    std::vector<float> values(grid->lights.size() * cells, 1.0f);
    for (std::size_t i = 0; i < grid->lights.size(); ++i)
      if (grid->lights[i] % 2 == 0) values[i * cells] = 1.0f + 7.0f * float(cells);
    tables.set_emission(values);
    ++rounds;
  }
  return rounds;
}

}  // namespace

TEST_CASE("tables: emission by programs is measured once for all that share it, and again when it changes") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_material(1, varying());
  r.scene.upsert_instance(1, instance_of(1, at(0), {1}));
  r.scene.upsert_instance(2, instance_of(1, at(5), {1}));
  r.update();
  REQUIRE(r.tables.emission_wanted());
  CHECK(r.tables.emission_wanted()->lights == std::vector<std::uint32_t>{0, 1});
  CHECK(r.tables.emission_wanted()->size == 4);
  CHECK_THROWS_AS(r.tables.set_emission(std::vector<float>(7)), std::invalid_argument);
  CHECK(answer(r.tables) == 2);
  for (const std::size_t first : {0, 2}) {
    CHECK(r.see.light(first).emission.y == doctest::Approx(8));
    CHECK(r.see.light(first + 1).emission.y == doctest::Approx(1));
    CHECK(r.see.light(first).emission_map == 1);
    CHECK(r.see.light(first + 1).emission_map == 0);
    CHECK(r.see.alias(first).pdf == doctest::Approx(8.0 / 18));
  }
  CHECK(r.tables.root().emission_maps != 0);

  // What moves is not measured again, and keeps what it has; nor are lamps' edits a reason.
  r.scene.upsert_instance(2, instance_of(1, at(7), {1}));
  r.scene.upsert_light(1, lamp(HW_LIGHT_POINT, 0));
  r.update();
  CHECK_FALSE(r.tables.emission_wanted());
  CHECK(r.see.light(3).position.x == 6);
  CHECK(r.see.light(3).emission.y == doctest::Approx(8));
  CHECK(r.see.light(3).emission_map == 1);
  r.scene.remove_light(1);
  r.update();
  CHECK_FALSE(r.tables.emission_wanted());

  // Mesh, material, an image that it reads: each is.
  r.scene.upsert_mesh(1, quad());
  r.update();
  CHECK(r.see.light(0).emission.y == doctest::Approx(8));  // until it is, what was known stands
  CHECK(answer(r.tables) == 2);
  ImageData image;
  image.width = image.height = 1;
  image.format = HW_TEXEL_R8;
  image.texels = {255};
  MaterialData textured = varying();
  textured.images = {1};
  r.scene.upsert_image(1, image);
  r.scene.upsert_material(1, textured);
  r.update();
  CHECK(answer(r.tables) == 2);
  r.scene.upsert_image(1, image);
  r.update();
  CHECK(answer(r.tables) == 2);

  // Another object's colour is another emission; a constant one needs no measuring.
  InstanceData red = instance_of(1, at(9), {1});
  red.color = {1, 0, 0};
  r.scene.upsert_instance(3, red);
  r.update();
  REQUIRE(r.tables.emission_wanted());
  CHECK(r.tables.emission_wanted()->lights == std::vector<std::uint32_t>{4, 5});
  CHECK(answer(r.tables) == 2);
  CHECK(r.see.light(4).emission_map + r.see.light(0).emission_map == 2 + emission_map_floats(64));
  CHECK(r.see.light(2).emission_map == r.see.light(0).emission_map);
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));
  r.update();
  CHECK_FALSE(r.tables.emission_wanted());
  CHECK(r.see.light(0).emission.y == 3);
  CHECK(r.see.light(0).emission_map == 0);
}

TEST_CASE("tables: what was measured as dark can still be chosen, and maps stay within their memory") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_material(1, varying());
  r.scene.upsert_instance(1, instance_of(1, at(0), {1}));
  r.update();
  r.tables.set_emission(std::vector<float>(32));
  CHECK_FALSE(r.tables.emission_wanted());
  CHECK(r.see.alias(0).pdf == doctest::Approx(0.5));
  CHECK(r.see.light(0).emission.x > 0);

  MeshData many;
  many.name = "many";
  many.positions = quad().positions;
  for (int i = 0; i < 20000; ++i)
    for (const std::uint32_t v : quad().tri_vertices) many.tri_vertices.push_back(v);
  r.scene.upsert_mesh(1, many);
  r.update();
  REQUIRE(r.tables.emission_wanted());
  CHECK(r.tables.emission_wanted()->lights.size() == 40000);
  CHECK(answer(r.tables) == 2);
  std::size_t mapped = 0;
  for (std::uint32_t i = 0; i < 40000; ++i) mapped += r.see.light(i).emission_map != 0;
  CHECK(mapped == 4096);
}

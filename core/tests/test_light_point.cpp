// SPDX-License-Identifier: Apache-2.0
// Points on lights as samples that any receiver can use: light_point() finds the point that light_sample() drew, and
// its density makes uniform places estimate the same light as light_sample() does.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "light_cases.h"
#include "lights/world_distribution.h"

using namespace hw;
using namespace hw::light_test;

TEST_CASE("light points are those that light samples drew") {
  Random random(1);
  int drawn = 0;
  for (std::uint32_t round = 0; round < 40; ++round) {
    for (const LightCase& c : light_cases(round)) {
      CAPTURE(c.name);
      CAPTURE(round);
      int wrong_way = 0, wrong_distance = 0, wrong_radiance = 0, wrong_normal = 0, wrong_pdf = 0, dark = 0, count = 0;
      for (int i = 0; i < 100; ++i) {
        const vec3 P = receiver(c, i, random);
        LightSample s;
        if (!light_sample(c.light, 0, P, vec3(random(), random(), 0), s)) continue;
        ++count;
        const vec2 uv = light_point_uv(c.light, P, s);
        CHECK(uv.x >= 0);
        CHECK(uv.x <= 1);
        CHECK(uv.y >= 0);
        CHECK(uv.y <= 1);
        const LightPoint p = light_point(c.light, uv, P);
        // Near a rim and at grazing angles the inverse loses digits: there are few of those.
        wrong_way += !(length(p.wi - s.wi) < 3e-4f);
        wrong_distance += s.distance == HW_INFINITY ? p.distance != HW_INFINITY
                                                    : !(std::abs(p.distance - s.distance) < 2e-3f * s.distance);
        wrong_normal += !(dot(p.normal, s.normal) > 0.999f);
        wrong_radiance += !(std::abs(p.radiance.x - s.radiance.x) <= 0.01f * s.radiance.x);
        dark += !(p.density > 0);
        CHECK(p.delta == ((s.flags & HW_LIGHT_SAMPLE_DELTA) != 0u));
        const float pdf = light_point_mis_pdf(c.light, 0, {}, P, p, s.uv);
        wrong_pdf += !p.delta && !(std::abs(pdf - s.pdf) <= 5e-3f * s.pdf);
        if (p.delta) CHECK(p.density == 1.0f);
      }
      drawn += count;
      CHECK(wrong_way <= count / 25);
      CHECK(wrong_distance <= count / 25);
      CHECK(wrong_normal <= count / 25);
      CHECK(wrong_radiance <= count / 25);
      CHECK(wrong_pdf <= count / 25);
      CHECK(dark <= count / 25);
    }
  }
  CHECK(drawn > 50000);
}

TEST_CASE("even places times density are the light that arrives") {
  // Plain, and with a weight of direction, which a wrong point would get wrong even where the whole light is right.
  Random random(2);
  double squares = 0, worst = 0;
  int tests = 0;
  for (std::uint32_t round = 0; round < 4; ++round) {
    for (const LightCase& c : light_cases(100 + round)) {
      CAPTURE(c.name);
      CAPTURE(round);
      for (int how = 0; how < 4; ++how) {
        CAPTURE(how);
        // Even places hardly ever fall where a narrow spread lights what is near.
        if (c.light.type == HW_LIGHT_AREA && c.light.spot_smooth > 0 && how % 4 != 0) continue;
        const vec3 P = receiver(c, how, random);
        const vec3 lean = random.direction();
        Mean sampled[2], even[2];
        bool delta = false;
        for (int i = 0; i < 4000; ++i) {
          LightSample s;
          const bool lit = light_sample(c.light, 0, P, vec3(random(), random(), 0), s);
          const double from = lit ? s.radiance.x / s.pdf : 0;
          sampled[0].add(from);
          sampled[1].add(from * dot(lean, s.wi));
          const LightPoint p = light_point(c.light, even_place(c.light, vec2(random(), random())), P);
          const double to = double(p.radiance.x) * p.density;
          even[0].add(to);
          even[1].add(to * dot(lean, p.wi));
          delta = p.delta;
        }
        for (int k = 0; k < 2; ++k) {
          CAPTURE(k);
          CAPTURE(sampled[k].mean());
          CAPTURE(even[k].mean());
          const double sigma = std::hypot(sampled[k].error(), even[k].error());
          const double scale = std::max(std::abs(sampled[0].mean()), std::abs(even[0].mean()));
          const double off = std::abs(sampled[k].mean() - even[k].mean());
          CHECK(off <= 6 * sigma + 1e-3 * scale);
          if (delta || !(sigma > 1e-4 * scale)) continue;
          const double z = off / sigma;
          worst = std::max(worst, z);
          squares += z * z;
          ++tests;
        }
      }
    }
  }
  CAPTURE(worst);
  REQUIRE(tests > 300);
  CHECK(squares / tests < 1.35);  // 1 where all means agree; skewed noise makes it a little more
}

TEST_CASE("a place on a light is the same for all receivers") {
  Random random(3);
  for (const LightCase& c : light_cases(7)) {
    // A disk faces its receiver, a spread of nothing has one point for each.
    if (lamp_sphere_is_disk(c.light) && c.light.type <= HW_LIGHT_SPOT) continue;
    if (c.name == "rectangle without a spread") continue;
    CAPTURE(c.name);
    for (int i = 0; i < 50; ++i) {
      const vec3 P = receiver(c, 0, random), Q = receiver(c, 0, random);
      const vec2 uv = even_place(c.light, vec2(random(), random()));
      const LightPoint p = light_point(c.light, uv, P), q = light_point(c.light, uv, Q);
      if (p.distance == HW_INFINITY) {
        CHECK(p.wi == q.wi);
      } else {
        CHECK(length(P + p.wi * p.distance - Q - q.wi * q.distance) < 1e-4f);
      }
    }
  }
}

TEST_CASE("a place on a light goes with the light") {
  // Moved, the same place sends the same light to a receiver that moved with it; grown, it is a proportion of it.
  LightRecord before = triangle(vec3(0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(1), true);
  LightRecord after = triangle(vec3(3, 1, 2), vec3(5, 1, 2), vec3(3, 4, 2), vec3(1), true);
  const LightPoint p = light_point(before, vec2(0.25f, 0.5f), vec3(0, 0, 1));
  const LightPoint q = light_point(after, vec2(0.25f, 0.5f), vec3(3, 1, 3));
  CHECK(length(vec3(0, 0, 1) + p.wi * p.distance - vec3(0.25f, 0.5f, 0)) < 1e-6f);
  CHECK(length(vec3(3, 1, 3) + q.wi * q.distance - vec3(3.5f, 2.5f, 2)) < 1e-6f);
  CHECK(q.density == doctest::Approx(3 / (1 + 0.25 + 2.25) / std::sqrt(3.5)));
}

TEST_CASE("the world's places cover the sphere evenly and its samples find theirs") {
  Random random(4);
  LightRecord world{};
  world.type = HW_LIGHT_WORLD;
  Mean light, up;
  for (int i = 0; i < 20000; ++i) {
    const LightPoint p = light_point(world, vec2(random(), random()), vec3(1, 2, 3));
    CHECK(p.density == doctest::Approx(4 * 3.14159265));
    CHECK(p.distance == HW_INFINITY);
    light.add(p.wi.x > 0 ? p.density * p.wi.x : 0);  // of the hemisphere about x: pi
    up.add(p.wi.z > 0.9f ? p.density : 0);           // a cap about the pole: 2 pi / 10
    const vec3 wi = random.direction();
    CHECK(length(light_world_direction(light_world_uv(wi)) - wi) < 2e-3f);
  }
  CHECK(std::abs(light.mean() - 3.14159265) < 5 * light.error());
  CHECK(std::abs(up.mean() - 0.2 * 3.14159265) < 5 * up.error());
  for (const vec3 pole : {vec3(0, 0, 1), vec3(0, 0, -1)})
    CHECK(length(light_world_direction(light_world_uv(pole)) - pole) < 1e-3f);
}

TEST_CASE("light points are finite at any receiver") {
  Random random(5);
  for (const LightCase& c : light_cases(9)) {
    CAPTURE(c.name);
    const vec3 center = c.light.position;
    std::vector<vec3> places = {center, center + vec3(1e-20f), center + c.light.axis_z * 1e-8f, vec3(1e18f)};
    if (c.light.type == HW_LIGHT_TRIANGLE) places.push_back(center + c.light.axis_x * 0.3f + c.light.axis_y * 0.3f);
    for (const vec3 P : places) {
      for (int i = 0; i < 20; ++i) {
        const LightPoint p = light_point(c.light, even_place(c.light, vec2(random(), random())), P);
        CHECK(std::isfinite(p.wi.x + p.wi.y + p.wi.z + p.distance + p.density + p.radiance.x));
        CHECK(p.density >= 0);
      }
    }
  }
}

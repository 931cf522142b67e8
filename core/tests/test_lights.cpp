// SPDX-License-Identifier: Apache-2.0
// Light sampling against brute force: every kind of light is integrated by tracing uniform directions at its shape, and
// the estimator, the pdf and the distances of light_sample must agree with that; and with irradiance rendered by
// Cycles.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "lib/light_sampling.h"
#include "lib/sampler.h"
#include "lights/light_table.h"

using namespace hw;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Random {
  std::mt19937 engine;
  explicit Random(std::uint32_t seed) : engine(seed) {}
  float operator()(float a = 0, float b = 1) {
    return a + (b - a) * std::uniform_real_distribution<float>(0, 1)(engine);
  }
  vec3 direction() { return warp_sphere(vec2((*this)(), (*this)())); }
};

// Rotation by Blender's XYZ Euler angles, scale and place, row-major.
Matrix34 place(vec3 at, vec3 angles = vec3(0), vec3 scale = vec3(1)) {
  const double cx = std::cos(angles.x), sx = std::sin(angles.x), cy = std::cos(angles.y), sy = std::sin(angles.y);
  const double cz = std::cos(angles.z), sz = std::sin(angles.z);
  const double r[3][3] = {{cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz},
                          {cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz},
                          {-sy, sx * cy, cx * cy}};
  Matrix34 m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[4 * i + j] = static_cast<float>(r[i][j] * scale[j]);
    m[4 * i + 3] = at[i];
  }
  return m;
}

LightData lamp(std::uint32_t type, Matrix34 matrix, float power = 100) {
  LightData d;
  d.name = "lamp";
  d.type = type;
  d.object_to_world = matrix;
  d.power = power;
  return d;
}

// First hit of a ray from P with a lamp's shape, written apart from the shader code. Negative: missed.
double intersect(const LampShape& s, glm::dvec3 P, glm::dvec3 d) {
  const glm::dvec3 c(s.center);
  const auto plane = [&](glm::dvec3 n) { return glm::dot(c - P, n) / glm::dot(d, n); };
  if (s.shape == HW_LAMP_SHAPE_SPHERE) {
    const glm::dvec3 o = P - c;
    const double b = glm::dot(o, d), q = b * b - glm::dot(o, o) + double(s.radius) * s.radius;
    if (q < 0) return -1;
    const double t0 = -b - std::sqrt(q), t1 = -b + std::sqrt(q);
    return t0 > 0 ? t0 : t1;
  }
  if (s.shape == HW_LAMP_SHAPE_FACING_DISK) {
    const double t = plane(glm::normalize(P - c));
    return t > 0 && glm::length(P + t * d - c) <= s.radius ? t : -1;
  }
  if (s.shape == HW_LAMP_SHAPE_NONE) return -1;
  const glm::dvec3 x(s.axis_x), y(s.axis_y), n = glm::cross(x, y);
  if (glm::dot(d, n) <= 0) return -1;
  const double t = plane(n);
  const glm::dvec3 q = P + t * d - c;
  const double u = glm::dot(q, x) / glm::dot(x, x), v = glm::dot(q, y) / glm::dot(y, y);
  const bool on = s.shape == HW_LAMP_SHAPE_ELLIPSE ? u * u + v * v <= 1 : std::max(std::abs(u), std::abs(v)) <= 1;
  return t > 0 && on ? t : -1;
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
  double mean() const { return sum / static_cast<double>(n); }
  double error() const {
    const double m = mean();
    return std::sqrt(std::max(0.0, squares / static_cast<double>(n) - m * m) / static_cast<double>(n));
  }
};

bool agree(const Mean& a, const Mean& b, double slack) {
  const double sigma = std::sqrt(a.error() * a.error() + b.error() * b.error());
  return std::abs(a.mean() - b.mean()) <= 5 * sigma + slack * std::max(std::abs(a.mean()), std::abs(b.mean()));
}

// Compares light_sample with directions uniform in a cone that holds the light. `trace` gives the distance of a hit (or
// a negative number), `emitted` the radiance seen along it.
void compare(const std::string& name, const LightRecord& light, vec3 P, vec3 axis, float height, std::uint32_t seed,
             const std::function<double(vec3)>& trace, const std::function<double(vec3, float)>& emitted) {
  CAPTURE(name);
  CAPTURE(P.x);
  CAPTURE(P.y);
  CAPTURE(P.z);
  constexpr int kSamples = 20000;
  Random random(seed);
  const vec3 weight = random.direction() * 2.0f;
  // What is compared: the light that arrives, and the pdf over what is lit, plain and with a weight of direction.
  Mean light_by_sampling, light_by_force, hits_by_sampling, hits_by_force, way_by_sampling, way_by_force;
  int wrong_pdf = 0, wrong_distance = 0, not_finite = 0;
  for (int i = 0; i < kSamples; ++i) {
    LightSample s;
    const bool lit = light_sample(light, 0, P, vec3(random(), random(), random()), s);
    if (lit) {
      const float pdf = light_pdf(light, 0, P, s.wi, s.distance, s.uv);
      wrong_pdf += !(std::abs(pdf - s.pdf) <= 2e-3f * s.pdf);
      not_finite += !std::isfinite(s.wi.x + s.wi.y + s.wi.z + s.pdf + s.radiance.x) || !(s.pdf > 0);
      if (s.distance < HW_INFINITY) {
        const double t = trace(s.wi);
        // A rim sample may miss by rounding: that is not counted, a wrong distance is.
        wrong_distance += t > 0 && std::abs(t - s.distance) > 2e-3 * t + 1e-5;
      }
    }
    light_by_sampling.add(lit ? s.radiance.x / s.pdf : 0);
    hits_by_sampling.add(lit ? 1 : 0);
    way_by_sampling.add(lit ? glm::dot(weight, s.wi) : 0);

    float cap;
    const vec3 wi = warp_cone(axis, height, vec2(random(), random()), cap);
    const double t = trace(wi);
    const double radiance = t > 0 ? emitted(wi, static_cast<float>(t)) : 0;
    const double solid_angle = 2 * kPi * height;
    const double pdf = radiance > 0 ? light_pdf(light, 0, P, wi, static_cast<float>(t), vec2(0)) * solid_angle : 0;
    light_by_force.add(radiance * solid_angle);
    hits_by_force.add(pdf);
    way_by_force.add(pdf * glm::dot(weight, wi));
  }
  CHECK(wrong_pdf <= kSamples / 2000);
  CHECK(wrong_distance <= kSamples / 500);
  CHECK(not_finite == 0);
  CAPTURE(light_by_sampling.mean());
  CAPTURE(light_by_force.mean());
  CHECK(agree(light_by_sampling, light_by_force, 2e-3));
  CAPTURE(hits_by_sampling.mean());
  CAPTURE(hits_by_force.mean());
  CHECK(agree(hits_by_sampling, hits_by_force, 2e-3));
  CAPTURE(way_by_sampling.mean());
  CAPTURE(way_by_force.mean());
  CHECK(agree(way_by_sampling, way_by_force, 4e-3));
}

void compare_lamp(const std::string& name, const LightData& data, vec3 P, std::uint32_t seed) {
  const Lamp made = make_lamp(data, 10);
  REQUIRE(made.reason == "");
  const LightRecord& light = made.record;
  const vec3 to = light.position - P;
  const float distance = glm::length(to);
  const bool flat = light.type == HW_LIGHT_AREA;
  const float bound = flat ? glm::length(made.shape.axis_x) + glm::length(made.shape.axis_y) : light.size_x;
  const float height = distance > bound ? warp_one_minus_cos(bound * bound / (distance * distance)) : 2.0f;
  compare(
      name, light, P, distance > 0 ? to / distance : vec3(0, 0, 1), height, seed,
      [&](vec3 wi) { return intersect(made.shape, glm::dvec3(P), glm::dvec3(wi)); },
      [&](vec3 wi, float t) {
        float pdf;
        bool visible;
        const vec3 radiance = lamp_emission(light, P, wi, t, pdf, visible);
        CHECK(visible == (radiance.x > 0));
        return static_cast<double>(radiance.x);
      });
}

}  // namespace

TEST_CASE("point and spot lamps agree with brute force") {
  Random random(1);
  for (int i = 0; i < 24; ++i) {
    const bool spot = i % 2 == 1;
    const vec3 scale = i % 3 == 2 ? vec3(random(0.5f, 2), random(0.5f, 2), random(0.5f, 2)) : vec3(1);
    LightData d = lamp(spot ? HW_LIGHT_SPOT : HW_LIGHT_POINT, place(vec3(0), random.direction() * 3.0f, scale));
    if (i % 4 >= 2) d.flags |= HW_LIGHT_SOFT_FALLOFF;
    d.radius = random(0.05f, 1);
    d.spot_size = random(0.1f, 3.1f);
    d.spot_blend = i % 5 == 0 ? 0 : random();
    // Spots are looked at from within their cone, mostly.
    const Matrix34& m = d.object_to_world;
    const vec3 ahead = -glm::normalize(vec3(m[2], m[6], m[10]));
    const vec3 way =
        spot ? glm::normalize(ahead + random.direction() * (0.6f * std::sin(0.5f * d.spot_size))) : random.direction();
    compare_lamp("outside", d, way * (d.radius * random(1.05f, 8)), i);
    compare_lamp("inside or near the middle", d, way * (d.radius * random(0.2f, 0.98f)), 100 + i);
  }
}

TEST_CASE("spots whose cone is narrower than their sphere are sampled by the cone") {
  LightData d = lamp(HW_LIGHT_SPOT, place(vec3(0)));
  d.radius = 1;
  d.spot_size = 0.3f;
  for (const bool soft : {false, true}) {
    d.flags = soft ? d.flags | HW_LIGHT_SOFT_FALLOFF : d.flags;
    compare_lamp("on the axis", d, vec3(0, 0, -2), 1);
    compare_lamp("beside the axis", d, vec3(0.4f, 0.3f, -1.5f), 2);
    compare_lamp("half out of the beam", d, vec3(1, 0, -1.5f), 3);
  }
}

TEST_CASE("area lamps agree with brute force") {
  Random random(2);
  for (int i = 0; i < 32; ++i) {
    LightData d =
        lamp(HW_LIGHT_AREA, place(vec3(0), random.direction() * 3.0f, i % 4 == 3 ? vec3(-1.5f, 1, 1) : vec3(1)));
    d.size_x = random(0.1f, 3);
    d.size_y = i % 5 == 0 ? d.size_x : random(0.1f, 3);
    d.ellipse = i % 2 == 1;
    d.spread = i % 3 == 0 ? random(0.3f, 3) : 3.14159265f;
    const Matrix34& m = d.object_to_world;
    const vec3 x = glm::normalize(vec3(m[0], m[4], m[8])), z = -glm::normalize(vec3(m[2], m[6], m[10]));
    const float reach = d.spread < 3 ? std::tan(0.45f * d.spread) : 1;
    compare_lamp("in front", d, z * random(0.2f, 2) + x * (reach * random(-0.4f, 0.4f)), i);
    compare_lamp("near the plane", d, z * 0.02f + x * (d.size_x * random(-0.7f, 0.7f)), 100 + i);
  }
  LightData d = lamp(HW_LIGHT_AREA, place(vec3(0)));
  LightSample s;
  CHECK_FALSE(light_sample(make_lamp(d, 1).record, 0, vec3(0, 0, 1), vec3(0.5f), s));  // behind
  compare_lamp("small and far", lamp(HW_LIGHT_AREA, place(vec3(0))), vec3(3, 0, -60), 7);
}

TEST_CASE("a narrow spread is sampled where it lights, for any shape") {
  Random random(3);
  for (int i = 0; i < 8; ++i) {
    LightData d = lamp(HW_LIGHT_AREA, place(vec3(0)));
    d.size_x = 2;
    d.size_y = i < 4 ? 2 : 1.6f;
    d.ellipse = i % 2 == 0;
    d.spread = i % 4 < 2 ? 0.02f : 0.3f;
    const LightRecord light = make_lamp(d, 1).record;
    const vec3 P(0.1f, -0.2f, -3);
    Mean all;
    for (int k = 0; k < 20000; ++k) {
      LightSample s;
      all.add(light_sample(light, 0, P, vec3(random(), random(), 0), s)
                  ? s.radiance.x / s.pdf * -glm::dot(s.wi, s.normal)
                  : 0);
    }
    // Where the lamp's whole beam is seen, irradiance is the lamp's flux over its area, whatever the spread.
    CHECK(all.mean() == doctest::Approx(kPi * light.emission.x).epsilon(0.02));
    CHECK(all.error() < 0.02 * all.mean());
  }
}

TEST_CASE("suns agree with brute force and are normalised") {
  for (const float angle : {0.01f, 0.5f, 3.14159265f}) {
    LightData d = lamp(HW_LIGHT_SUN, place(vec3(0), vec3(0.5f, 0.3f, 0.2f)), 3);
    d.angle = angle;
    const LightRecord light = make_lamp(d, 10).record;
    compare(
        "sun", light, vec3(1, 2, 3), light.axis_z, light.size_y * 1.5f, 5,
        [&](vec3 wi) {
          float pdf;
          return sun_emission(light, wi, pdf).x > 0 ? double(HW_INFINITY) : -1;
        },
        [&](vec3, float) { return double(light.emission.x); });
    // Irradiance across its axis is the power.
    Mean all;
    Random random(4);
    for (int i = 0; i < 20000; ++i) {
      LightSample s;
      REQUIRE(light_sample(light, 0, vec3(0), vec3(random(), random(), 0), s));
      all.add(s.radiance.x / s.pdf * glm::dot(s.wi, light.axis_z));
    }
    CHECK(std::abs(all.mean() - 3) <= 5 * all.error() + 1e-3);
  }
}

TEST_CASE("lamps without size are deltas with the right strength") {
  LightData d = lamp(HW_LIGHT_POINT, place(vec3(0, 0, 2)));
  LightSample s;
  LightRecord light = make_lamp(d, 1).record;
  REQUIRE(light_sample(light, 0, vec3(0), vec3(0.3f), s));
  CHECK(s.flags == HW_LIGHT_SAMPLE_DELTA);
  CHECK(s.pdf == 1.0f);
  CHECK(s.distance == doctest::Approx(2));
  CHECK(s.radiance.x == doctest::Approx(100 / (4 * kPi) / 4));
  CHECK(light_pdf(light, 0, vec3(0), s.wi, s.distance, s.uv) == 0.0f);
  d.normalize = false;
  light = make_lamp(d, 1).record;
  REQUIRE(light_sample(light, 0, vec3(0), vec3(0.3f), s));
  CHECK(s.radiance.x == doctest::Approx(100 / kPi / 4));

  d = lamp(HW_LIGHT_SUN, place(vec3(0)), 5);
  light = make_lamp(d, 1).record;
  REQUIRE(light_sample(light, 0, vec3(0), vec3(0.3f), s));
  CHECK(s.radiance.x == doctest::Approx(5));
  CHECK(s.wi.z == doctest::Approx(1));
  CHECK(s.distance == HW_INFINITY);

  d = lamp(HW_LIGHT_AREA, place(vec3(0, 0, 2)));
  d.spread = 0;
  light = make_lamp(d, 1).record;
  REQUIRE(light_sample(light, 0, vec3(0.4f, 0, 0), vec3(0.3f), s));
  CHECK(s.flags == HW_LIGHT_SAMPLE_DELTA);
  CHECK(s.radiance.x == doctest::Approx(100));
  CHECK_FALSE(light_sample(light, 0, vec3(0.6f, 0, 0), vec3(0.3f), s));
}

TEST_CASE("emissive triangles agree with brute force") {
  Random random(6);
  for (int i = 0; i < 30; ++i) {
    LightRecord light{};
    light.type = HW_LIGHT_TRIANGLE;
    light.flags = i % 2 == 0 ? HW_LIGHT_TWO_SIDED : 0u;
    const float size = i % 3 == 0 ? 0.05f : 1.0f;
    light.position = random.direction() * size;
    light.axis_x = random.direction() * size;
    light.axis_y = i % 7 == 6 ? light.axis_x * 0.5f + random.direction() * (size * 0.02f) : random.direction() * size;
    const vec3 n = glm::cross(light.axis_x, light.axis_y);
    light.area = 0.5f * glm::length(n);
    light.axis_z = glm::normalize(n);
    light.emission = vec3(2);
    const vec3 middle = light.position + (light.axis_x + light.axis_y) / 3.0f;
    const float above = i % 5 == 0 ? 0.01f * size : random(0.1f, 3);
    const float side = i % 4 == 0 ? -1 : 1;
    const vec3 P = middle + light.axis_z * (above * side) + light.axis_x * random(-0.5f, 0.5f);
    const vec3 to = middle - P;
    const float bound = size * 2, distance = glm::length(to);
    const float height = distance > bound ? warp_one_minus_cos(bound * bound / (distance * distance)) : 2.0f;
    const bool sampled = side > 0 || (light.flags & HW_LIGHT_TWO_SIDED);
    compare(
        "triangle", light, P, to / distance, height, i,
        [&](vec3 wi) {
          const glm::dvec3 d(wi), e1(light.axis_x), e2(light.axis_y), a(P - light.position), p = glm::cross(d, e2),
                                                                                             q = glm::cross(a, e1);
          const double det = glm::dot(e1, p), u = glm::dot(a, p) / det, v = glm::dot(d, q) / det,
                       t = glm::dot(e2, q) / det;
          return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : -1.0;
        },
        [&](vec3, float) { return sampled ? 2.0 : 0.0; });
    LightSample s;
    CHECK(light_sample(light, 0, P, vec3(0.3f, 0.6f, 0), s) == sampled);
    if (sampled) {
      const vec3 at = light.position + light.axis_x * s.uv.x + light.axis_y * s.uv.y;
      CHECK(glm::length(at - (P + s.wi * s.distance)) < 1e-4f);
    }
  }
  // In its own plane, and a triangle without area.
  LightRecord light{};
  light.type = HW_LIGHT_TRIANGLE;
  light.flags = HW_LIGHT_TWO_SIDED;
  light.axis_x = vec3(1, 0, 0);
  light.axis_y = vec3(0, 1, 0);
  light.axis_z = vec3(0, 0, 1);
  light.emission = vec3(1);
  LightSample s;
  CHECK_FALSE(light_sample(light, 0, vec3(0, 0, 1), vec3(0.5f), s));
  light.area = 0.5f;
  CHECK_FALSE(light_sample(light, 0, vec3(2, 2, 0), vec3(0.5f), s));
  CHECK(light_sample(light, 0, vec3(0, 0, 1), vec3(0.5f), s));
}

// Mean radiance over a white diffuse plane z = 0, |x|, |y| < 3 m, under one lamp of 100 W (sun: 3 W/m^2), rendered with
// Cycles 5.0.1 (CPU, direct light only, box filter, at least 256 samples a pixel, 32 x 32 pixels).
TEST_CASE("lamps light a plane as Cycles 5.0.1 does") {
  const vec3 at(0.3f, -0.4f, 2), turn(0.5f, 0.3f, 0.2f);
  const Matrix34 up = place(at), tilted = place(at, turn), scaled = place(at, turn, vec3(2, 0.5f, 1.3f));
  struct Case {
    const char* name;
    double cycles;
    LightData data;
  };
  std::vector<Case> cases;
  const auto add = [&](const char* name, double cycles, std::uint32_t type, const Matrix34& m, auto&& edit) {
    LightData d = lamp(type, m, type == HW_LIGHT_SUN ? 3.0f : 100.0f);
    edit(d);
    cases.push_back({name, cycles, d});
  };
  const std::uint32_t soft = HW_LIGHT_SOFT_FALLOFF;
  add("point", 0.213146, HW_LIGHT_POINT, up, [](LightData&) {});
  add("point, not normalised", 0.852585, HW_LIGHT_POINT, up, [](LightData& d) { d.normalize = false; });
  add("point 0.5 soft", 0.205577, HW_LIGHT_POINT, up, [&](LightData& d) { d.radius = 0.5f, d.flags |= soft; });
  add("point 0.5", 0.213152, HW_LIGHT_POINT, up, [](LightData& d) { d.radius = 0.5f; });
  add("point 0.5, not normalised", 0.669638, HW_LIGHT_POINT, up,
      [](LightData& d) { d.radius = 0.5f, d.normalize = false; });
  add("point 0.5 scaled", 0.213152, HW_LIGHT_POINT, scaled, [](LightData& d) { d.radius = 0.5f; });
  add("spot", 0.031127, HW_LIGHT_SPOT, tilted, [](LightData&) {});
  add("spot 0.3 soft", 0.040018, HW_LIGHT_SPOT, tilted,
      [&](LightData& d) { d.radius = 0.3f, d.spot_blend = 0.5f, d.spot_size = 1, d.flags |= soft; });
  add("spot 0.3", 0.040549, HW_LIGHT_SPOT, tilted,
      [](LightData& d) { d.radius = 0.3f, d.spot_blend = 0.5f, d.spot_size = 1; });
  add("spot 0.3 no blend", 0.019778, HW_LIGHT_SPOT, tilted,
      [](LightData& d) { d.radius = 0.3f, d.spot_blend = 0, d.spot_size = 0.6f; });
  add("spot 0.3 scaled", 0.023280, HW_LIGHT_SPOT, scaled,
      [](LightData& d) { d.radius = 0.3f, d.spot_blend = 0.5f, d.spot_size = 1; });
  add("spot, sphere wider than cone", 0.001878, HW_LIGHT_SPOT, tilted,
      [](LightData& d) { d.radius = 1, d.spot_blend = 0.3f, d.spot_size = 0.2f; });
  add("spot of half a turn", 0.147091, HW_LIGHT_SPOT, tilted,
      [&](LightData& d) { d.radius = 0.1f, d.spot_blend = 1, d.spot_size = 3.14159265f, d.flags |= soft; });
  add("sun", 0.800599, HW_LIGHT_SUN, tilted, [](LightData&) {});
  add("sun 0.5", 0.800607, HW_LIGHT_SUN, tilted, [](LightData& d) { d.angle = 0.5f; });
  add("sun 0.5, not normalised", 0.153951, HW_LIGHT_SUN, tilted,
      [](LightData& d) { d.angle = 0.5f, d.normalize = false; });
  add("sun, half the sky", 0.877792, HW_LIGHT_SUN, tilted, [](LightData& d) { d.angle = 3.14159265f; });
  add("square", 0.560981, HW_LIGHT_AREA, tilted, [](LightData&) {});
  add("square scaled, not normalised", 0.557490, HW_LIGHT_AREA, scaled, [](LightData& d) { d.normalize = false; });
  add("rectangle", 0.561916, HW_LIGHT_AREA, tilted, [](LightData& d) { d.size_y = 0.4f; });
  add("disk", 0.561609, HW_LIGHT_AREA, tilted, [](LightData& d) { d.ellipse = true; });
  add("ellipse scaled, not normalised", 0.175669, HW_LIGHT_AREA, scaled,
      [](LightData& d) { d.ellipse = true, d.size_y = 0.4f, d.normalize = false; });
  add("rectangle, spread 1", 0.883906, HW_LIGHT_AREA, tilted, [](LightData& d) { d.size_y = 0.4f, d.spread = 1; });
  add("disk, spread 1", 0.883418, HW_LIGHT_AREA, tilted, [](LightData& d) { d.ellipse = true, d.spread = 1; });
  add("ellipse, spread 0.1", 0.883860, HW_LIGHT_AREA, tilted,
      [](LightData& d) { d.ellipse = true, d.size_y = 0.4f, d.spread = 0.1f; });
  add("square, spread 0", 0.883840, HW_LIGHT_AREA, tilted, [](LightData& d) { d.spread = 0; });
  for (const Case& c : cases) {
    const Lamp made = make_lamp(c.data, 10);
    REQUIRE(made.reason == "");
    constexpr uint kPoints = 1u << 18;
    double sum = 0;
    for (uint i = 0; i < kPoints; ++i) {
      const vec4 u = sampler_4d(77, i, 0, 1);
      const vec3 P((u.x - 0.5f) * 6, (u.y - 0.5f) * 6, 0);
      LightSample s;
      if (light_sample(made.record, 0, P, vec3(u.z, u.w, 0), s)) sum += std::max(0.0f, s.wi.z) * s.radiance.x / s.pdf;
    }
    CAPTURE(c.name);
    CHECK(sum / kPoints / kPi == doctest::Approx(c.cycles).epsilon(0.004));
  }
}

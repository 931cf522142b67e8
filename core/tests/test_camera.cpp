// SPDX-License-Identifier: Apache-2.0
// Camera rays: corners, shift, projections and back, depth of field, clip planes, panoramas, the passes' distances; and
// that every header of light sampling, sampler, filter and camera is valid GLSL.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "lib/camera.h"

using namespace hw;

namespace {

void set_panorama(CameraRecord& c, uint kind, const std::array<float, 4>& range) {
  c.panorama = kind;
  std::copy(range.begin(), range.end(), c.panorama_range);
  c.left = c.previous_left = c.bottom = c.previous_bottom = 0;
  c.right = c.previous_right = c.top = c.previous_top = 1;
}

CameraRecord camera(uint type) {
  CameraRecord c{};
  const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  for (int i = 0; i < 12; ++i) c.camera_to_world[i] = c.previous_world_to_camera[i] = identity[i];
  c.type = type;
  c.left = c.previous_left = -0.4f;
  c.right = c.previous_right = 0.6f;
  c.bottom = c.previous_bottom = -0.25f;
  c.top = c.previous_top = 0.35f;
  c.clip_start = 0.1f;
  c.clip_end = 100;
  c.focus_distance = 4;
  c.aperture_ratio = 1;
  if (type == HW_CAMERA_PANORAMIC) set_panorama(c, HW_PANORAMA_EQUIRECTANGULAR, {-HW_PI, HW_PI, -HW_PI / 2, HW_PI / 2});
  return c;
}

// Rigid: a turn about the axis (1, 2, 2) / 3 by 0.8, then a place.
void turn(CameraRecord& c) {
  const glm::vec3 k(1.0f / 3, 2.0f / 3, 2.0f / 3);
  const float s = std::sin(0.8f), o = std::cos(0.8f);
  for (int j = 0; j < 3; ++j) {
    glm::vec3 e(0);
    e[j] = 1;
    const glm::vec3 r = e * o + glm::cross(k, e) * s + k * glm::dot(k, e) * (1 - o);
    for (int i = 0; i < 3; ++i) c.camera_to_world[4 * i + j] = r[i];
  }
  c.camera_to_world[3] = 3;
  c.camera_to_world[7] = -2;
  c.camera_to_world[11] = 1.5f;
}

struct CameraRay {
  vec3 origin, direction;
  float tmin, tmax;
  vec3 at(float t) const { return origin + direction * t; }
};

CameraRay ray(const CameraRecord& c, vec2 raster, vec2 lens = vec2(0.5f)) {
  CameraRay r;
  camera_ray(c, raster, lens, r.origin, r.direction, r.tmin, r.tmax);
  return r;
}

bool near(vec3 a, vec3 b, float slack = 1e-5f) { return glm::length(a - b) <= slack; }

}  // namespace

TEST_CASE("perspective rays go through the corners of the picture plane, shift included") {
  const CameraRecord c = camera(HW_CAMERA_PERSPECTIVE);
  for (const vec2 raster : {vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(1, 1), vec2(0.3f, 0.8f)}) {
    const CameraRay r = ray(c, raster);
    CHECK(near(r.origin, vec3(0)));
    CHECK(glm::length(r.direction) == doctest::Approx(1));
    const vec3 p = r.direction / -r.direction.z;
    CHECK(near(p, vec3(-0.4f + raster.x, -0.25f + 0.6f * raster.y, -1)));
    // Clip planes lie across the viewing direction.
    CHECK(r.at(r.tmin).z == doctest::Approx(-0.1));
    CHECK(r.at(r.tmax).z == doctest::Approx(-100));
  }
}

TEST_CASE("orthographic rays are parallel and start on the picture plane") {
  CameraRecord c = camera(HW_CAMERA_ORTHOGRAPHIC);
  const CameraRay r = ray(c, vec2(1, 0));
  CHECK(near(r.origin, vec3(0.6f, -0.25f, 0)));
  CHECK(near(r.direction, vec3(0, 0, -1)));
  CHECK(r.tmin == doctest::Approx(0.1));
  CHECK(r.tmax == doctest::Approx(100));
}

TEST_CASE("projection inverts the rays, for every camera, in this frame and the last") {
  std::mt19937 engine(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const uint type : {HW_CAMERA_PERSPECTIVE, HW_CAMERA_ORTHOGRAPHIC, HW_CAMERA_PANORAMIC}) {
    CameraRecord c = camera(type);
    turn(c);
    // The last frame: the inverse of this frame's matrix, with another picture plane.
    for (int i = 0; i < 3; ++i) {
      float moved = 0;
      for (int j = 0; j < 3; ++j) {
        c.previous_world_to_camera[4 * i + j] = c.camera_to_world[4 * j + i];
        moved -= c.camera_to_world[4 * j + i] * c.camera_to_world[4 * j + 3];
      }
      c.previous_world_to_camera[4 * i + 3] = moved;
    }
    c.previous_right = c.left + 2 * (c.right - c.left);  // twice as wide
    for (int i = 0; i < 200; ++i) {
      const vec2 raster(0.02f + 0.96f * uniform(engine), 0.02f + 0.96f * uniform(engine));
      const CameraRay r = ray(c, raster);
      const vec3 P = r.at(0.5f + 20 * uniform(engine));
      const vec2 now = camera_project(c, P), before = camera_project_previous(c, P);
      CHECK(std::abs(now.x - raster.x) < 2e-5f);
      CHECK(std::abs(now.y - raster.y) < 2e-5f);
      CHECK(std::abs(before.x - raster.x / 2) < 2e-5f);
      CHECK(std::abs(before.y - raster.y) < 2e-5f);
    }
  }
}

TEST_CASE("rays of one picture point meet on the plane of focus and fill the aperture") {
  std::mt19937 engine(4);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const uint type : {HW_CAMERA_PERSPECTIVE, HW_CAMERA_ORTHOGRAPHIC}) {
    for (const uint blades : {0u, 3u, 5u, 8u}) {
      CameraRecord c = camera(type);
      c.aperture_radius = 0.2f;
      c.aperture_blades = blades;
      c.aperture_rotation = 0.3f;
      c.aperture_ratio = 1.5f;
      CameraRecord pinhole = c;
      pinhole.aperture_radius = 0;
      const CameraRay chief = ray(pinhole, vec2(0.8f, 0.3f));
      const vec3 focus = chief.at(4 / -chief.direction.z);
      vec2 mean(0);
      float widest_x = 0, widest_y = 0;
      for (int i = 0; i < 4000; ++i) {
        const CameraRay r = ray(c, vec2(0.8f, 0.3f), vec2(uniform(engine), uniform(engine)));
        CHECK(near(r.at((-4 - r.origin.z) / r.direction.z), focus, 1e-4f));
        const vec3 lens = r.origin - chief.origin;
        widest_x = std::max(widest_x, std::abs(lens.x));
        widest_y = std::max(widest_y, std::abs(lens.y));
        mean += vec2(lens.x, lens.y) / 4000.0f;
        const float x = lens.x * 1.5f, radius = std::sqrt(x * x + lens.y * lens.y);
        CHECK(radius <= 0.2001f);
        if (blades >= 3) {
          // Inside the polygon with a side facing the turned x axis.
          const float side = 2 * HW_PI / float(blades);
          float phi = std::atan2(lens.y, x) - 0.3f;
          phi -= side * std::round(phi / side);
          CHECK(radius * std::cos(phi) <= 0.2f * std::cos(0.5f * side) + 1e-5f);
        }
      }
      CHECK(glm::length(mean) < 0.01f);
      CHECK(widest_x > 0.2f / 1.5f * 0.75f);
      CHECK(widest_x < 0.1335f);
      CHECK(widest_y > 0.15f);
    }
  }
}

TEST_CASE("the aperture is filled evenly") {
  CameraRecord c = camera(HW_CAMERA_PERSPECTIVE);
  for (const uint blades : {0u, 6u}) {
    c.aperture_blades = blades;
    double inner = 0;
    constexpr int kSide = 256;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const vec2 p = camera_aperture(c, vec2((float(x) + 0.5f) / kSide, (float(y) + 0.5f) / kSide));
        inner += p.x * p.x + p.y * p.y < 0.25f;
      }
    }
    // A circle of half the radius: a quarter of the disk; of the hexagon, pi / 4 over 3 sqrt(3) / 2.
    CHECK(inner / (kSide * kSide) == doctest::Approx(blades == 0 ? 0.25 : 0.30229989).epsilon(0.003));
  }
}

TEST_CASE("a panorama looks ahead in its middle, left at a quarter, up at the top") {
  CameraRecord c = camera(HW_CAMERA_PANORAMIC);
  CHECK(near(ray(c, vec2(0.5f, 0.5f)).direction, vec3(0, 0, -1)));
  CHECK(near(ray(c, vec2(0.25f, 0.5f)).direction, vec3(-1, 0, 0)));
  CHECK(near(ray(c, vec2(0.75f, 0.5f)).direction, vec3(1, 0, 0)));
  CHECK(near(ray(c, vec2(0.3f, 1)).direction, vec3(0, 1, 0)));
  CHECK(near(ray(c, vec2(0, 0.5f)).direction, vec3(0, 0, 1)));
  CHECK(ray(c, vec2(0.1f, 0.2f)).tmin == doctest::Approx(0.1));
}

TEST_CASE("every panorama: projection inverts the rays, and is as wide as it says") {
  struct Kind {
    uint kind;
    std::array<float, 4> range;
    float widest;  // distance from the middle within which there is a picture
    std::array<float, 4> lens = {};
  };
  const std::array<float, 4> bent = {-0.02f, -3e-4f, 3e-6f, -2.6e-8f}, mirrored = {0.018f, 0, 2e-5f, 0};
  const Kind kinds[] = {{HW_PANORAMA_EQUIRECTANGULAR, {-1.2f, 2.0f, -0.4f, 0.9f}, 1},
                        {HW_PANORAMA_FISHEYE_EQUIDISTANT, {3.5f, 0, 0, 0}, 0.5f},
                        {HW_PANORAMA_FISHEYE_EQUISOLID, {10.5f, 3.0f, 36, 30}, 0.39f},
                        {HW_PANORAMA_MIRROR_BALL, {0, 0, 0, 0}, 0.5f},
                        {HW_PANORAMA_CUBE_FACE, {0, 0, 0, 0}, 1},
                        {HW_PANORAMA_CYLINDRICAL, {-2.5f, 2.5f, -0.5f, 1.5f}, 1},
                        {HW_PANORAMA_FISHEYE_POLYNOMIAL, {3.5f, 1e-5f, 60, 50}, 0.5f, bent},
                        {HW_PANORAMA_FISHEYE_POLYNOMIAL, {3.5f, 0.05f, 60, 50}, 0.5f, mirrored}};
  std::mt19937 engine(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const Kind& k : kinds) {
    CameraRecord c = camera(HW_CAMERA_PANORAMIC);
    set_panorama(c, k.kind, k.range);
    std::copy(k.lens.begin(), k.lens.end(), c.panorama_lens);
    c.left = -0.1f, c.top = 1.3f;  // a viewport sees more than the frame
    turn(c);
    for (int i = 0; i < 300; ++i) {
      const vec2 raster(0.02f + 0.96f * uniform(engine), 0.02f + 0.96f * uniform(engine));
      const vec2 p(-0.1f + 1.1f * raster.x, 1.3f * raster.y);
      const bool inside =
          k.widest == 1 ? p.x > 0 && p.x < 1 && p.y > 0 && p.y < 1 : glm::distance(p, vec2(0.5f)) < 0.98f * k.widest;
      if (!inside) continue;
      const CameraRay r = ray(c, raster);
      CHECK(glm::length(r.direction) == doctest::Approx(1));
      const vec2 back = camera_project(c, r.at(0.5f + 20 * uniform(engine)));
      CHECK(std::abs(back.x - raster.x) < 1e-4f);
      CHECK(std::abs(back.y - raster.y) < 1e-4f);
    }
    // Across the middle a small step turns by about the width over its share.
    if (k.kind == HW_PANORAMA_MIRROR_BALL || k.kind == HW_PANORAMA_FISHEYE_EQUISOLID) continue;
    const vec3 a = panorama_to_direction(k.kind, camera_panorama_range(c), camera_panorama_lens(c), vec2(0.49f, 0.5f));
    const vec3 b = panorama_to_direction(k.kind, camera_panorama_range(c), camera_panorama_lens(c), vec2(0.51f, 0.5f));
    CHECK(glm::distance(a, b) ==
          doctest::Approx(0.02f * panorama_width(k.kind, camera_panorama_range(c), camera_panorama_lens(c)))
              .epsilon(0.2));
  }
}

TEST_CASE("fisheyes and mirror balls show nothing outside their circle") {
  CameraRecord c = camera(HW_CAMERA_PANORAMIC);
  set_panorama(c, HW_PANORAMA_FISHEYE_EQUIDISTANT, {3, 0, 0, 0});
  CHECK(ray(c, vec2(0.01f, 0.01f)).direction == vec3(0));
  CHECK(near(ray(c, vec2(0.5f, 0.5f)).direction, vec3(0, 0, -1)));
  CHECK(near(ray(c, vec2(1, 0.5f)).direction, vec3(std::sin(1.5f), 0, -std::cos(1.5f))));
  set_panorama(c, HW_PANORAMA_FISHEYE_EQUISOLID, {10, 1, 36, 24});  // sees less than the sensor is large
  CHECK(ray(c, vec2(0.9f, 0.5f)).direction == vec3(0));
  set_panorama(c, HW_PANORAMA_FISHEYE_POLYNOMIAL, {1.6f, 0, 36, 24});
  c.panorama_lens[0] = -0.05f;
  CHECK(ray(c, vec2(0.96f, 0.5f)).direction == vec3(0));
  CHECK(near(ray(c, vec2(0.9f, 0.5f)).direction, vec3(std::sin(0.72f), 0, -std::cos(0.72f))));
  set_panorama(c, HW_PANORAMA_MIRROR_BALL, {0, 0, 0, 0});
  CHECK(ray(c, vec2(0.9f, 0.9f)).direction == vec3(0));
  CHECK(near(ray(c, vec2(0.5f, 0.5f)).direction, vec3(0, 0, -1)));
  CHECK(near(ray(c, vec2(0.5f + 0.25f * std::sqrt(2.0f), 0.5f)).direction, vec3(1, 0, 0), 1e-3f));
}

TEST_CASE("a panorama's focus is a sphere, and its aperture faces the ray") {
  std::mt19937 engine(8);
  std::uniform_real_distribution<float> uniform(0, 1);
  CameraRecord c = camera(HW_CAMERA_PANORAMIC);
  set_panorama(c, HW_PANORAMA_FISHEYE_EQUIDISTANT, {3, 0, 0, 0});
  c.aperture_radius = 0.2f;
  CameraRecord pinhole = c;
  pinhole.aperture_radius = 0;
  for (const vec2 raster : {vec2(0.5f, 0.5f), vec2(0.9f, 0.4f), vec2(0.2f, 0.7f)}) {
    const vec3 ahead = ray(pinhole, raster).direction;
    float widest = 0;
    for (int i = 0; i < 500; ++i) {
      const CameraRay r = ray(c, raster, vec2(uniform(engine), uniform(engine)));
      CHECK(std::abs(glm::dot(r.origin, ahead)) < 1e-5f);
      CHECK(glm::length(r.origin) <= 0.2001f);
      CHECK(near(r.at(std::sqrt(16 + glm::dot(r.origin, r.origin))), ahead * 4.0f, 1e-4f));
      widest = std::max(widest, glm::length(r.origin));
    }
    CHECK(widest > 0.18f);
  }
}

// Values of Cycles 5.0.1: camera at (0, 0, 5), turned by 0.1 rad about x, mist from 2 over 8 m, quadratic.
TEST_CASE("depth and mist are Cycles'") {
  CameraRecord c = camera(HW_CAMERA_PERSPECTIVE);
  const float s = std::sin(0.1f), o = std::cos(0.1f);
  const float m[12] = {1, 0, 0, 0, 0, o, -s, 0, 0, s, o, 5};
  for (int i = 0; i < 12; ++i) c.camera_to_world[i] = m[i];
  vec3 P(-3.911057f, -3.4290192f, 0);
  CHECK(camera_depth(c, P) == doctest::Approx(4.6327).epsilon(1e-4));
  CHECK(camera_mist(c, P, 2, 8, 2) == doctest::Approx(0.42492).epsilon(1e-4));
  c.type = HW_CAMERA_ORTHOGRAPHIC;
  P = vec3(-2.7186573f, -2.230632f, 0);
  CHECK(camera_depth(c, P) == doctest::Approx(4.7523).epsilon(1e-4));
  CHECK(camera_mist(c, P, 2, 8, 2) == doctest::Approx(0.11836).epsilon(1e-4));
  c.type = HW_CAMERA_PANORAMIC;
  P = vec3(-3.5004764f, -4.264507f, 0);
  CHECK(camera_depth(c, P) == doctest::Approx(7.4458).epsilon(1e-4));
  CHECK(camera_mist(c, P, 2, 8, 2) == doctest::Approx(0.46338).epsilon(1e-4));
  CHECK(camera_mist(c, P, 2, 8, 1) == doctest::Approx(std::sqrt(0.46338)).epsilon(1e-4));
  CHECK(camera_mist(c, P, 9, 8, 0.5f) == 0);
  CHECK(camera_mist(c, P, 0, 1, 0.5f) == 1);
}

TEST_CASE("the headers compile as GLSL") {
  namespace fs = std::filesystem;
  const fs::path shaders = fs::path(__FILE__).parent_path().parent_path().parent_path() / "shaders";
  REQUIRE(fs::exists(shaders / "lib" / "camera.h"));
  const fs::path folder = fs::temp_directory_path() / ("headwater_glsl_" + std::to_string(std::random_device{}()));
  fs::create_directories(folder);
  const fs::path source = folder / "headers.comp", spirv = folder / "headers.spv";
  std::ofstream(source) << R"(#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_sampling.h"
#include "lib/world_sampling.h"
#include "lib/sampler.h"
#include "lib/filter.h"
#include "lib/camera.h"
layout(local_size_x = 64) in;
layout(buffer_reference, scalar) buffer Work {
  LightRecord light; CameraRecord camera; WorldDistribution world; vec3 P; float sum;
};
layout(push_constant, scalar) uniform Push { uint64_t address; };
void main() {
  Work w = Work(address);
  uint x = gl_GlobalInvocationID.x;
  vec4 u = sampler_4d(sampler_pixel_hash(x, 1u), 3u, HW_DIM_LENS, 5u);
  vec3 v = sampler_blue_3d(x, 2u, 0u, 4u, 5u, 6u) + sampler_3d(x, 1u, 2u, 3u);
  v += vec3(sampler_1d(x, 0u, 0u, 0u), sampler_2d(x, 0u, 1u, 0u));
  LightSample s;
  float sum = sampler_blue_1d(x, 0u, 0u, 1u, 2u, 3u) + sampler_blue_2d(x, 0u, 0u, 1u, 2u, 3u).x;
  if (light_sample(w.light, 0ul, w.P, u.xyz, s)) { sum += light_pdf(w.light, 0ul, w.P, s.wi, s.distance, s.uv) * s.radiance.x; }
  float pdf; bool visible; vec3 wi, origin; float tmin, tmax;
  sum += lamp_emission(w.light, w.P, s.wi, s.distance, pdf, visible).x + pdf + float(visible);
  sum += sun_emission(w.light, s.wi, pdf).x + pdf;
  world_sample(w.world, u.xy, wi, pdf);
  sum += pdf * world_pdf(w.world, wi) + filter_sample(x % 3u, 1.5, v.xy).x;
  camera_ray(w.camera, u.xy, u.zw, origin, wi, tmin, tmax);
  sum += camera_project(w.camera, origin + wi * tmin).x + camera_project_previous(w.camera, w.P).y + tmax;
  w.sum = sum + camera_mist(w.camera, w.P, 1.0, 2.0, 2.0) + camera_depth(w.camera, w.P);
}
)";
  const std::string command = "glslangValidator --quiet -V --target-env vulkan1.2 -I'" + shaders.string() + "' -o '" +
                              spirv.string() + "' '" + source.string() + "'";
  CHECK(std::system(command.c_str()) == 0);
  CHECK(fs::exists(spirv));
  fs::remove_all(folder);
}

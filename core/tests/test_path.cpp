// SPDX-License-Identifier: Apache-2.0
// Whole renders with known answers: furnaces, lamps over a plane, determinism.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <numeric>

#include "session/session.h"
#include "shared/material_program.h"

using namespace hw;

namespace {

std::shared_ptr<Context> shared_context() {
  static std::shared_ptr<Context> context = make_context("", "auto", 0, true);
  return context;
}

// A program of one Diffuse row (shared/material_program.h): colour, roughness 0, the interpolated normal, weight 1.
MaterialData diffuse_material(float r, float g, float b) {
  const std::uint32_t c = HW_OPERAND_CONSTANT;
  MaterialData m;
  m.name = "diffuse";
  m.program = {HW_PROGRAM_MAGIC, 1, 0, 0, HW_OP_DIFFUSE, c | (c + 1) << 16, HW_REGISTER_NORMAL, c + 2,
               HW_OP_END,        0, 0, 0};
  m.constants = {r, g, b, 0, 0, 0, 0, 0, 1, 1, 1, 1};
  return m;
}

MaterialData emission_material(float radiance) {
  MaterialData m;
  m.name = "emission";
  m.program = {HW_PROGRAM_MAGIC, 1, 1, 0, HW_OP_EMISSION, HW_OPERAND_CONSTANT, 0, 0, HW_OP_END, 0, 0, 0};
  m.constants = {radiance, radiance, radiance, 0};
  m.flags = HW_MATERIAL_EMISSIVE;
  m.emission = {radiance, radiance, radiance};
  return m;
}

MeshData quad(float half) {
  MeshData m;
  m.name = "quad";
  m.positions = {-half, -half, 0, half, -half, 0, half, half, 0, -half, half, 0};
  m.tri_vertices = {0, 1, 2, 0, 2, 3};
  return m;
}

MeshData cube(float half) {
  MeshData m;
  m.name = "cube";
  for (int i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) m.positions.push_back((i >> axis & 1) ? half : -half);
  m.tri_vertices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                    2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return m;
}

const Matrix34 kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

CameraData camera_at(float x, float y, float z, float half_width = 0.25f) {
  CameraData c{};
  const Matrix34 m{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
  std::copy(m.begin(), m.end(), c.camera_to_world);
  c.left = -half_width, c.right = half_width, c.bottom = -half_width, c.top = half_width;
  c.type = HW_CAMERA_PERSPECTIVE;
  c.clip_start = 0.01f, c.clip_end = 1000;
  c.focus_distance = 1;
  c.aperture_ratio = 1;
  return c;
}

std::shared_ptr<Scene> plane_scene(float albedo) {
  auto scene = std::make_shared<Scene>();
  scene->upsert_mesh(1, quad(50));
  scene->upsert_material(1, diffuse_material(albedo, albedo, albedo));
  InstanceData instance;
  instance.name = "plane";
  instance.mesh = 1;
  instance.materials = {1};
  instance.object_to_world = kIdentity;
  scene->upsert_instance(1, instance);
  scene->set_camera(camera_at(0, 0, 2, 0.01f));
  return scene;
}

std::vector<float> render(const std::shared_ptr<Scene>& scene, RenderSettings s,
                          std::shared_ptr<Context> context = shared_context()) {
  Session session(context, scene);
  session.sync();
  if (s.width == 0) s.width = s.height = 16;
  session.start(s);
  session.finish();
  std::vector<float> out(std::size_t(s.width) * s.height * 4);
  session.read("Combined", out.data(), out.size());
  CHECK(context->device->validation_messages() == 0);
  return out;
}

struct Mean {
  double value, error;
};
Mean mean_of(const std::vector<float>& rgba) {
  double sum = 0, sum2 = 0;
  const std::size_t n = rgba.size() / 4;
  for (std::size_t i = 0; i < n; ++i) sum += rgba[i * 4 + 1], sum2 += double(rgba[i * 4 + 1]) * rgba[i * 4 + 1];
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(sum2 / n - mean * mean, 1e-12) / n)};
}

void check_mean(const std::vector<float>& image, double expected) {
  const Mean m = mean_of(image);
  INFO("mean " << m.value << " +- " << m.error << ", expected " << expected);
  CHECK(std::abs(m.value - expected) < 4.5 * m.error + 2e-4 * expected);
}

}  // namespace

TEST_CASE("a plane under a white sky returns its albedo") {
  auto scene = plane_scene(0.6f);
  WorldData world;
  world.color = {1, 1, 1};
  scene->set_world(world);
  RenderSettings s;
  s.samples = 64;
  for (std::uint32_t bounces : {0u, 4u}) {
    s.max_bounces = bounces;
    check_mean(render(scene, s), 0.6);
  }
}

TEST_CASE("the inside of a grey emitting box is a geometric series") {
  auto scene = std::make_shared<Scene>();
  scene->upsert_mesh(1, cube(1));
  MaterialData m = diffuse_material(0.5f, 0.5f, 0.5f);
  m.program = {HW_PROGRAM_MAGIC,
               1,
               4,
               0,
               HW_OP_DIFFUSE,
               HW_OPERAND_CONSTANT | (HW_OPERAND_CONSTANT + 1) << 16,
               HW_REGISTER_NORMAL,
               HW_OPERAND_CONSTANT + 2,
               HW_OP_EMISSION,
               HW_OPERAND_CONSTANT + 2,
               0,
               0,
               HW_OP_END,
               0,
               0,
               0,
               HW_OP_EMISSION,
               HW_OPERAND_CONSTANT + 2,
               0,
               0,
               HW_OP_END,
               0,
               0,
               0};
  m.flags = HW_MATERIAL_EMISSIVE;
  m.emission = {1, 1, 1};
  scene->upsert_material(1, m);
  InstanceData instance;
  instance.name = "box";
  instance.mesh = 1;
  instance.materials = {1};
  instance.object_to_world = kIdentity;
  scene->upsert_instance(1, instance);
  scene->set_camera(camera_at(0.1f, 0.2f, 0.3f));
  RenderSettings s;
  s.samples = 256;
  // 1 + a + a^2 + ...: light seen directly, direct light, and one term more for each bounce.
  double expected = 1.5, term = 0.5;
  for (std::uint32_t bounces = 0; bounces < 4; ++bounces) {
    s.max_bounces = s.diffuse_bounces = bounces;
    for (const char* lights : {"uniform", "power", "tree"}) {
      s.lights = lights;
      check_mean(render(scene, s), expected);
    }
    term *= 0.5;
    expected += term;
  }
}

TEST_CASE("a point lamp lights a plane by the inverse square") {
  auto scene = plane_scene(0.8f);
  LightData lamp;
  lamp.name = "lamp";
  lamp.power = 100;
  lamp.object_to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3};
  scene->upsert_light(1, lamp);
  RenderSettings s;
  s.samples = 16;
  s.max_bounces = 0;
  // Radiant intensity P / (4 pi), irradiance I / d^2, radiance albedo / pi times that (Cycles' point lamp).
  const double pi = 3.14159265358979;
  check_mean(render(scene, s), 0.8 / pi * 100 / (4 * pi) / 9);
}

TEST_CASE("the picture does not depend on waves or threads") {
  auto scene = plane_scene(0.8f);
  for (int i = 0; i < 5; ++i) {
    LightData lamp;
    lamp.name = "lamp";
    lamp.power = 50;
    lamp.radius = 0.3f;
    lamp.object_to_world = {1, 0, 0, float(i) - 2, 0, 1, 0, 0, 0, 0, 1, 1.5f};
    scene->upsert_light(10 + i, lamp);
  }
  scene->set_camera(camera_at(0, 0, 4, 0.5f));
  RenderSettings s;
  s.width = 50, s.height = 30;
  s.samples = 7;
  s.max_bounces = 2;
  const auto whole = render(scene, s);
  s.tile_pixels = 128;
  CHECK(render(scene, s) == whole);
  s.tile_pixels = 4096;
  CHECK(render(scene, s) == whole);
  s.seed = 5;
  CHECK(render(scene, s) != whole);
  // A region holds the same pixels as the whole.
  s.seed = 0, s.tile_pixels = 0;
  s.region = {10, 5, 30, 25};
  auto context = shared_context();
  Session session(context, scene);
  session.sync();
  session.start(s);
  session.finish();
  std::vector<float> part(20 * 20 * 4);
  session.read("Combined", part.data(), part.size());
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x)
      for (int c = 0; c < 4; ++c) REQUIRE(part[(y * 20 + x) * 4 + c] == whole[((y + 5) * 50 + x + 10) * 4 + c]);
}

// Staging, readback and a host Tracer that copies, as a GPU would have them; and the picture stays the same to the bit.
TEST_CASE("a device with memory of its own renders the same picture") {
  auto scene = plane_scene(0.8f);
  LightData lamp;
  lamp.name = "lamp";
  lamp.power = 50;
  lamp.radius = 0.3f;
  lamp.object_to_world = {1, 0, 0, 0.5f, 0, 1, 0, 0, 0, 0, 1, 1.5f};
  scene->upsert_light(1, lamp);
  WorldData world;
  world.color = {0.2f, 0.3f, 0.4f};
  scene->set_world(world);
  RenderSettings s;
  s.width = 40, s.height = 30;
  s.samples = 5;
  s.max_bounces = 3;
  for (const char* tracer : {"embree", "ray_query", "ray_pipeline"}) {
    std::shared_ptr<Context> shared;
    try {
      shared = make_context("", tracer, 0, true);
    } catch (const DeviceError& e) {
      MESSAGE(tracer << " left out: " << e.what());
      continue;
    }
    CAPTURE(std::string(tracer));
    const auto expected = render(scene, s, shared);
    setenv("HEADWATER_OWN_MEMORY", "1", 1);
    auto own = make_context("", tracer, 0, true);
    unsetenv("HEADWATER_OWN_MEMORY");
    REQUIRE(!own->device->shared_memory());
    CHECK(render(scene, s, own) == expected);
    if (std::string(tracer) == "embree") continue;
    // A frame is one submission: beside it, the film is emptied and the picture fetched. What steps cost is learnt from
    // frames, the first of which compile kernels: a slow one is cut until a quick one was seen.
    Session session(own, scene);
    session.sync();
    std::uint64_t fewest = 10;
    for (int frame = 0; frame < 10 && (frame < 3 || fewest > 3); ++frame) {
      session.start(s);
      session.finish();
      CHECK(own->device->submissions() <= 10);
      CHECK(own->device->host_waits() == own->device->submissions());
      fewest = std::min(fewest, own->device->submissions());
    }
    CHECK(fewest <= 3);
  }
}

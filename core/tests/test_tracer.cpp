// SPDX-License-Identifier: Apache-2.0
// All Tracers against a brute-force loop in double precision, against each other, through edits and degenerate input.

#include <doctest/doctest.h>

#include <functional>
#include <limits>

#include "lib/lamp_intersect.h"
#include "tests/trace_reference.h"

using namespace hw;
using namespace hw::test;

namespace {

bool runs_on(const Device& device, const std::string& kind) {
  return kind == "embree" || (kind == "ray_query" ? device.info().ray_query : device.info().ray_pipeline);
}

// Runs `body` on each Tracer the machine can run, with validation on; the layers must have nothing to say.
void with_tracers(const std::function<void(Device&, Tracer&)>& body) {
  static Device device({}, true);
  for (const char* kind : {"embree", "ray_query", "ray_pipeline"}) {
    if (!runs_on(device, kind)) {
      MESSAGE("skipped: ", kind, " on ", device.info().name, " (", device.info().driver, ")");
      continue;
    }
    CAPTURE(kind);
    const std::uint64_t before = device.validation_messages();
    const auto tracer = make_tracer(device, kind, 0);
    CHECK(std::string(tracer->name()) == kind);
    body(device, *tracer);
    CHECK(device.validation_messages() == before);
  }
}

TraceInstance place(std::uint64_t mesh, std::array<float, 12> m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                    std::uint32_t mask = 0xFF) {
  TraceInstance instance{{}, mesh, mask, false};
  std::copy(m.begin(), m.end(), instance.object_to_world);
  return instance;
}

MeshData square(float z, float half = 1) {
  return {{-half, -half, z, half, -half, z, half, half, z, -half, half, z}, {0, 1, 2, 0, 2, 3}};
}

Ray down(float x = 0.1f, float y = 0.2f, float z = 5, std::uint32_t mask = 0xFF) {
  return {{x, y, z}, 0, {0, 0, -1}, HW_INFINITY, mask};
}

// Rays that single precision can't decide are passed over, but must be few.
void compare(const World& world, const std::vector<Ray>& rays, const std::vector<Hit>& hits,
             const std::vector<std::uint32_t>& any) {
  int undecided = 0, wrong = 0, found = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto strict = all_hits(world, rays[i], -1e-4), loose = all_hits(world, rays[i], 1e-4);
    const bool decided =
        strict.size() == loose.size() && (strict.size() < 2 || strict[1].t - strict[0].t > 1e-4 * (1 + strict[0].t) ||
                                          strict[0].instance == HW_LAMP_INSTANCE);
    if (!decided) {
      ++undecided;
      continue;
    }
    const Hit& hit = hits[i];
    if (any[i] != (strict.empty() ? 0u : 1u)) ++wrong;
    if (strict.empty()) {
      if (hit.instance != HW_NONE || hit.primitive != HW_NONE) ++wrong;
      continue;
    }
    ++found;
    const Candidate& c = strict[0];
    const bool same = hit.instance == c.instance && hit.primitive == c.primitive &&
                      std::abs(hit.t - c.t) <= 2e-4 * (1 + c.t) && std::abs(hit.u - c.u) <= 2e-3 &&
                      std::abs(hit.v - c.v) <= 2e-3;
    if (!same) {
      ++wrong;
      INFO("ray ", i, ": t ", hit.t, " for ", c.t, ", instance ", hit.instance, " for ", c.instance, ", primitive ",
           hit.primitive, " for ", c.primitive, ", uv ", hit.u, " ", hit.v, " for ", c.u, " ", c.v);
      if (wrong < 5) CHECK(same);
    }
  }
  CHECK(wrong == 0);
  CHECK(found > static_cast<int>(rays.size() / 10));
  CHECK(undecided < static_cast<int>(rays.size() / 20));
}

World random_world(std::mt19937& random) {
  World world;
  for (int i = 0; i < 4; ++i) world.meshes.push_back(random_triangles(random, 40, 0.5f));
  world.instances = {
      place(0),                                                           // baked, identity
      place(1, {0.5f, 0.1f, 0, 1.2f, 0, 1.5f, 0.2f, 0, 0, 0, 0.7f, -1}),  // baked, sheared
      place(2, {-1, 0, 0, -1.5f, 0, 1, 0, 0.5f, 0, 0, 1, 0}),             // mirrored
      place(2, {0, -0.3f, 0, 0, 2, 0, 0, 0, 0, 0, 0.1f, 1.5f}),           // non-uniform scale and turn
      place(3, {1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1, 0}, HW_MASK_CAMERA | HW_MASK_SHADOW_OPAQUE),
      place(2, {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}),  // singular: not hit
  };
  world.instances[4].moves = true;
  world.lamps = {
      {HW_LAMP_SHAPE_SPHERE, {1, 1, 1}, {}, {}, 0.6f},
      {HW_LAMP_SHAPE_RECTANGLE, {-1, 0, 1}, {0.5f, 0, 0}, {0, 0.4f, 0.4f}, 0},
      {HW_LAMP_SHAPE_NONE, {0, 0, 0}, {5, 0, 0}, {0, 5, 0}, 5},
      {HW_LAMP_SHAPE_ELLIPSE, {0, -1, -1}, {0, 0.8f, 0}, {0, 0, 0.5f}, 0},
      {HW_LAMP_SHAPE_FACING_DISK, {-1, 1, -0.5f}, {}, {}, 0.5f},
  };
  return world;
}

}  // namespace

TEST_CASE("tracers agree with brute force: instances, masks, lamps, ray ends") {
  std::mt19937 random(7);
  const World world = random_world(random);
  std::vector<Ray> rays = random_rays(random, 3000, 2.5f);
  std::uniform_real_distribution<float> u(0, 1);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    static constexpr std::uint32_t kMasks[] = {0xFF, HW_MASK_CAMERA, HW_MASK_DIFFUSE, HW_MASK_GLOSSY | HW_MASK_LAMP,
                                               HW_MASK_LAMP};
    rays[i].mask = kMasks[i % 5];
    if (i % 3 == 1) rays[i].tmin = u(random);
    if (i % 4 == 1) rays[i].tmax = rays[i].tmin + 2 * u(random);
  }
  with_tracers([&](Device& device, Tracer& tracer) {
    world.give(tracer);
    Rig rig(device, 4096);
    const auto hits = rig.closest(tracer, rays);
    compare(world, rays, hits, rig.any(tracer, rays));
    CHECK(tracer.stats().build_bytes > 0);
    CHECK(tracer.stats().build_seconds > 0);
  });
}

// What a Tracer may leave out for rays that end at any surface (HW_RAY_SURFACES_DARK): never a lamp that is seen, never
// a way into the open that counts, and what is neither stays neither.
TEST_CASE("tracers: rays that only look for lamps find the same lamps") {
  std::mt19937 random(8);
  const World world = random_world(random);
  const std::vector<Ray> plain = random_rays(random, 3000, 2.5f);
  with_tracers([&](Device& device, Tracer& tracer) {
    world.give(tracer);
    Rig rig(device, 4096);
    const auto full = rig.closest(tracer, plain);
    for (const std::uint32_t flags : {HW_RAY_SURFACES_DARK, HW_RAY_SURFACES_DARK | HW_RAY_MISS_DARK}) {
      CAPTURE(flags);
      std::vector<Ray> rays = plain;
      for (Ray& ray : rays) ray.flags = flags;
      const auto hits = rig.closest(tracer, rays);
      int lamps = 0, wrong = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::uint32_t was = full[i].instance, is = hits[i].instance;
        lamps += was == HW_LAMP_INSTANCE;
        const bool same_lamp = is == was && hits[i].primitive == full[i].primitive && hits[i].t == full[i].t;
        const bool ends = was < HW_BLOCKED_INSTANCE || (was == HW_NONE && (flags & HW_RAY_MISS_DARK));
        if (was == HW_LAMP_INSTANCE) wrong += !same_lamp;
        if (was == HW_NONE && !ends) wrong += is != HW_NONE;
        if (ends) wrong += is != was && is != HW_BLOCKED_INSTANCE;
      }
      CHECK(lamps > 100);
      CHECK(wrong == 0);
    }
  });
}

TEST_CASE("tracers: nothing in the scene, nothing in the queue") {
  with_tracers([](Device& device, Tracer& tracer) {
    Rig rig(device, 64);
    tracer.commit();
    CHECK(rig.closest(tracer, {down()})[0].instance == HW_NONE);
    CHECK(rig.any(tracer, {down()})[0] == 0);
    CHECK(rig.closest(tracer, {}).empty());
    World world;
    world.lamps = {{HW_LAMP_SHAPE_SPHERE, {0, 0, 0}, {}, {}, 1}};
    world.give(tracer);
    CHECK(rig.closest(tracer, {down()})[0].instance == HW_LAMP_INSTANCE);
    CHECK(rig.closest(tracer, {down(0, 0, 5, HW_MASK_CAMERA)})[0].instance == HW_NONE);
    // Only nothings among the lamps, and a mesh without triangles.
    world.lamps = {{HW_LAMP_SHAPE_NONE, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1}};
    world.meshes = {MeshData{}};
    world.instances = {place(0)};
    world.give(tracer);
    CHECK(rig.closest(tracer, {down()})[0].instance == HW_NONE);
  });
}

TEST_CASE("tracers: objects move, change mask, are replaced, added and removed") {
  with_tracers([](Device& device, Tracer& tracer) {
    Rig rig(device, 64);
    const auto look = [&] { return rig.closest(tracer, {down()})[0]; };
    World world;
    world.meshes = {square(0), square(0)};
    world.instances = {place(0), place(1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1})};
    world.give(tracer);
    CHECK(look().instance == 0);
    CHECK(look().t == doctest::Approx(5));

    world.instances[1].object_to_world[11] = 2;  // moves: baked before, an instance from now on
    tracer.set_instances(world.instances);
    tracer.commit();
    CHECK(look().instance == 1);
    CHECK(look().t == doctest::Approx(3));
    world.instances[1].object_to_world[11] = 3;  // moves again: only its transform changes
    tracer.set_instances(world.instances);
    tracer.commit();
    CHECK(look().t == doctest::Approx(2));
    CHECK(rig.any(tracer, {down()})[0] == 1);

    world.instances[1].mask = HW_MASK_DIFFUSE;  // both of these changes go to different structures
    world.instances[0].mask = HW_MASK_CAMERA;
    tracer.set_instances(world.instances);
    tracer.commit();
    CHECK(rig.closest(tracer, {down(0.1f, 0.2f, 5, HW_MASK_CAMERA)})[0].instance == 0);
    CHECK(rig.closest(tracer, {down(0.1f, 0.2f, 5, HW_MASK_DIFFUSE)})[0].instance == 1);
    CHECK(rig.closest(tracer, {down(0.1f, 0.2f, 5, HW_MASK_GLOSSY)})[0].instance == HW_NONE);

    const MeshData higher = square(0.5f), other = square(-0.5f);  // same topology, other positions
    tracer.set_mesh(0, higher.view("higher"));
    tracer.set_mesh(1, other.view("other"));
    tracer.commit();
    CHECK(rig.closest(tracer, {down(0.1f, 0.2f, 5, HW_MASK_CAMERA)})[0].t == doctest::Approx(4.5));
    CHECK(rig.closest(tracer, {down(0.1f, 0.2f, 5, HW_MASK_DIFFUSE)})[0].t == doctest::Approx(2.5));

    const MeshData one{{-2, -2, 1, 2, -2, 1, 0, 3, 1}, {0, 1, 2}};  // other topology
    tracer.set_mesh(0, one.view("one triangle"));
    tracer.set_instances(
        std::vector<TraceInstance>{place(1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -3}), place(1), place(0)});
    tracer.commit();
    CHECK(look().instance == 2);  // indices are those of the last call
    CHECK(look().primitive == 0);
    CHECK(look().t == doctest::Approx(4));

    tracer.set_instances(std::vector<TraceInstance>{place(1)});
    tracer.remove_mesh(0);
    tracer.commit();
    CHECK(look().instance == 0);
    CHECK(look().t == doctest::Approx(5.5));
    tracer.set_instances({});
    tracer.remove_mesh(1);
    tracer.remove_mesh(1);
    tracer.remove_mesh(99);
    tracer.commit();
    CHECK(look().instance == HW_NONE);
    CHECK(rig.any(tracer, {down()})[0] == 0);
  });
}

TEST_CASE("tracers: random edits give what a fresh tracer gives") {
  with_tracers([](Device& device, Tracer& tracer) {
    std::mt19937 random(11);
    Rig rig(device, 512);
    World world = random_world(random);
    world.give(tracer);
    const auto rays = random_rays(random, 500, 2.5f);
    for (int step = 0; step < 12; ++step) {
      auto& instances = world.instances;
      TraceInstance& chosen = instances[random() % instances.size()];
      switch (step % 6) {
        case 0:
          chosen.object_to_world[3] += 0.3f;
          break;
        case 1:
          chosen.moves = !chosen.moves;
          break;
        case 2:
          instances.erase(instances.begin() + static_cast<int>(random() % instances.size()));
          break;
        case 3:
          instances.insert(instances.begin(), place(random() % 4, {1, 0, 0, 0.2f, 0, 0, 1, 0, 0, -1, 0, 0.4f}));
          break;
        case 4:
          world.meshes[1] = random_triangles(random, 30 + step, 0.5f);
          tracer.set_mesh(1, world.meshes[1].view("mesh 1"));
          break;
        case 5:
          chosen.mask = HW_MASK_CAMERA;
          break;
      }
      if (step % 4 == 3) {
        world.lamps[0].center.x += 0.2f;
        tracer.set_lamps(world.lamps);
      }
      tracer.set_instances(instances);
      tracer.commit();
      const auto fresh = make_tracer(device, tracer.name(), 1);
      world.give(*fresh);
      const auto a = rig.closest(tracer, rays), b = rig.closest(*fresh, rays);
      int different = 0;
      for (std::size_t i = 0; i < rays.size(); ++i)
        different += a[i].instance != b[i].instance || a[i].primitive != b[i].primitive ||
                     std::abs(a[i].t - b[i].t) > 1e-4f * (1 + b[i].t);
      CAPTURE(step);
      CHECK(different <= 1);  // a ray through an edge may see either side's triangle
    }
  });
}

TEST_CASE("embree: the same bits for any number of threads and any build") {
  std::mt19937 random(5);
  World world = random_world(random);
  world.meshes.push_back(random_triangles(random, 60'000, 0.02f));
  world.instances.push_back(place(4));
  const auto rays = random_rays(random, 20'000, 2);
  Device device;
  Rig rig(device, 20'000);
  std::vector<Hit> first;
  for (const int threads : {1, 2, 3, 0}) {
    const auto tracer = make_tracer(device, "embree", threads);
    world.give(*tracer);
    const auto hits = rig.closest(*tracer, rays);
    if (first.empty()) first = hits;
    CHECK(std::memcmp(first.data(), hits.data(), hits.size() * sizeof(Hit)) == 0);
  }
}

TEST_CASE("tracers: degenerate geometry and matrices are survived") {
  with_tracers([](Device& device, Tracer& tracer) {
    Rig rig(device, 64);
    World world;
    world.meshes = {square(0),
                    MeshData{{0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1}, {0, 1, 2, 0, 0, 0, 0, 3, 3}}};  // zero area
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
    world.instances = {place(1),
                       place(0, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}),
                       place(0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 4}),
                       place(0, {kNan, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}),
                       place(0, {1, 0, 0, kInf, 0, 1, 0, 0, 0, 0, 1, 0}),
                       place(0, {1e-3f, 0, 0, 0, 0, 1e-3f, 0, 0, 0, 0, 1e-3f, 4}),  // small, and good
                       place(0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 1})};            // mirrored
    world.give(tracer);
    CHECK(rig.closest(tracer, {down(1e-4f, 2e-4f)})[0].instance == 5);
    CHECK(rig.closest(tracer, {down()})[0].instance == 6);
    CHECK(rig.closest(tracer, {down()})[0].t == doctest::Approx(4));
  });
}

TEST_CASE("tracers: bad edits are refused by name") {
  with_tracers([](Device&, Tracer& tracer) {
    tracer.set_instances(std::vector<TraceInstance>{place(42)});
    CHECK_THROWS_WITH_AS(tracer.commit(), "Instance 0 is of a mesh that does not exist.", std::runtime_error);
    tracer.set_instances({});
    tracer.commit();
  });
  Device device;
  const auto embree = make_tracer(device, "embree", 1);
  const MeshData bad{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 3}};
  CHECK_THROWS_WITH_AS(embree->set_mesh(0, bad.view("Suzanne")),
                       "Mesh \"Suzanne\" has a triangle of vertex 3, but only 3 vertices.", std::runtime_error);
  CHECK_THROWS_AS(make_tracer(device, "optix", 0), DeviceError);
  for (const char* kind : {"ray_query", "ray_pipeline"})
    if (!runs_on(device, kind)) CHECK_THROWS_AS(make_tracer(device, kind, 0), DeviceError);
  CHECK(make_tracer(device, "auto", 0)->name() == std::string(best_tracer(device.info())));
}

TEST_CASE("tracers: what auto stands for on a device") {
  DeviceInfo info;
  info.kind = "discrete";
  CHECK(best_tracer(info) == std::string("embree"));
  info.ray_pipeline = true;
  CHECK(best_tracer(info) == std::string("ray_pipeline"));
  info.ray_query = true;
  CHECK(best_tracer(info) == std::string("ray_query"));
  info.kind = "cpu";
  CHECK(best_tracer(info) == std::string("embree"));
}

// A data-centre GPU has pipelines and no ray queries; older drivers launch only what the host sizes. The layers must
// have nothing to say about what is then used without being there.
TEST_CASE("ray_pipeline: without ray query, and without indirect launches") {
  std::mt19937 random(21);
  const World world = random_world(random);
  const auto rays = random_rays(random, 1000, 2.5f);
  std::vector<Hit> expected;
  for (const char* missing :
       {"", "VK_KHR_ray_query", "rayTracingPipelineTraceRaysIndirect", "VK_KHR_ray_tracing_pipeline"}) {
    CAPTURE(missing);
    setenv("HEADWATER_HIDE_EXTENSION", missing, 1);
    Device device({}, true);
    unsetenv("HEADWATER_HIDE_EXTENSION");
    if (missing == std::string("VK_KHR_ray_tracing_pipeline")) {
      CHECK_THROWS_WITH_AS(make_tracer(device, "ray_pipeline", 0), doctest::Contains(missing), DeviceError);
      continue;
    }
    if (missing == std::string("VK_KHR_ray_query"))
      CHECK_THROWS_WITH_AS(make_tracer(device, "ray_query", 0), doctest::Contains(missing), DeviceError);
    if (!runs_on(device, "ray_pipeline")) {
      MESSAGE("skipped: ", device.info().name, ": ", device.info().ray_pipeline_why_not);
      return;
    }
    const auto tracer = make_tracer(device, "ray_pipeline", 0);
    world.give(*tracer);
    Rig rig(device, 2048);  // more room than rays
    const auto hits = rig.closest(*tracer, rays);
    if (expected.empty()) expected = hits;
    CHECK(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof(Hit)) == 0);
    CHECK(device.validation_messages() == 0);
  }
}

// The driver may walk the same structure in the same way for both, or not: where it does, not a bit differs.
TEST_CASE("ray_query and ray_pipeline: the same hits, many at edges and lamps") {
  constexpr int kRays = 100'000;  // a million agreed too, docs/measurements/tracer.md
  Device device;
  if (!runs_on(device, "ray_query") || !runs_on(device, "ray_pipeline")) {
    MESSAGE("skipped: ", device.info().name, " has not both");
    return;
  }
  std::mt19937 random(22);
  World world = random_world(random);
  world.meshes.push_back(random_triangles(random, 1000, 0.1f));
  world.instances.push_back(place(4));
  auto rays = random_rays(random, kRays, 2.5f);
  const MeshData& mesh = world.meshes[4];
  for (std::size_t i = 0; i < rays.size(); i += 2) {  // at vertices and at the middles of edges
    const std::size_t triangle = 3 * (random() % (mesh.indices.size() / 3));
    const float* p = &mesh.positions[3 * mesh.indices[triangle]];
    const float* q = &mesh.positions[3 * mesh.indices[triangle + (i % 4 ? 1 : 0)]];
    rays[i].direction = glm::normalize((vec3(p[0], p[1], p[2]) + vec3(q[0], q[1], q[2])) * 0.5f - rays[i].origin);
    if (i % 3 == 0) rays[i].mask = HW_MASK_SHADOW_OPAQUE | HW_MASK_LAMP;
  }
  std::vector<Hit> hits[2];
  std::vector<std::uint32_t> any[2];
  Rig rig(device, kRays);
  for (const int k : {0, 1}) {
    const auto tracer = make_tracer(device, k ? "ray_pipeline" : "ray_query", 0);
    world.give(*tracer);
    hits[k] = rig.closest(*tracer, rays);
    any[k] = rig.any(*tracer, rays);
  }
  long different = 0, found = 0, lamps = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit &a = hits[0][i], &b = hits[1][i];
    found += a.instance != HW_NONE;
    lamps += a.instance == HW_LAMP_INSTANCE;
    different += a.instance != b.instance || a.primitive != b.primitive || a.t != b.t || a.u != b.u || a.v != b.v ||
                 any[0][i] != any[1][i];
  }
  CHECK(found > kRays / 2);
  CHECK(lamps > kRays / 100);
  CHECK(different <= (device.info().kind == "cpu" ? 0 : 100));
}

TEST_CASE("embree: closed surfaces have no cracks, far from the origin too") {
  // A finely cut sphere seen from inside: every ray must hit.
  MeshData sphere;
  constexpr int kN = 120;
  for (int j = 0; j <= kN; ++j)
    for (int i = 0; i <= kN; ++i) {
      const double a = 2 * 3.14159265358979 * (i % kN) / kN, b = 3.14159265358979 * j / kN;
      const double r = j == 0 || j == kN ? 0 : std::sin(b);
      for (const double x : {r * std::cos(a) + 100, r * std::sin(a) - 50, std::cos(b) + 20})
        sphere.positions.push_back(static_cast<float>(x));
    }
  for (std::uint32_t j = 0; j < kN; ++j)
    for (std::uint32_t i = 0; i < kN; ++i) {
      const std::uint32_t q = j * (kN + 1) + i;
      for (const std::uint32_t k : {q, q + 1, q + kN + 1, q + 1, q + kN + 2, q + kN + 1}) sphere.indices.push_back(k);
    }
  std::mt19937 random(3);
  auto rays = random_rays(random, 100'000, 0.3f);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].origin = rays[i].origin + vec3(100, -50, 20);
    if (i % 2) {  // straight at the middle of an edge
      const std::size_t triangle = random() % (sphere.indices.size() / 3);
      const float* p = &sphere.positions[3 * sphere.indices[3 * triangle]];
      const float* q = &sphere.positions[3 * sphere.indices[3 * triangle + 1]];
      rays[i].direction = glm::normalize((vec3(p[0], p[1], p[2]) + vec3(q[0], q[1], q[2])) * 0.5f - rays[i].origin);
    }
  }
  World world;
  world.meshes = {sphere};
  world.instances = {place(0)};
  Device device;
  const auto tracer = make_tracer(device, "embree", 0);
  world.give(*tracer);
  Rig rig(device, 100'000);
  long missed = 0;
  for (const Hit& hit : rig.closest(*tracer, rays)) missed += hit.instance == HW_NONE;
  CHECK(missed == 0);
}

TEST_CASE("lamp spheres: distant and small, tangent, from inside") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  int hits = 0;
  for (int i = 0; i < 20'000; ++i) {
    // Aimed at a point within 1.5 radii of the centre of a 1 cm lamp between 10 m and 10 km away.
    const double distance = std::pow(10.0, 2.5 + 1.5 * u(random)), radius = 0.01;
    const LampShape lamp{HW_LAMP_SHAPE_SPHERE,
                         vec3(float(0.3 * distance), float(-0.2 * distance), float(distance)),
                         {},
                         {},
                         float(radius)};
    const glm::dvec3 target = glm::dvec3(lamp.center) + 1.5 * radius * glm::dvec3(u(random), u(random), u(random));
    const vec3 direction(glm::normalize(target));
    const glm::dvec3 d(direction), c(lamp.center);
    const double b = glm::dot(c, d) / glm::dot(d, d), miss2 = glm::dot(c - b * d, c - b * d) / (radius * radius);
    float t;
    const bool hit = lamp_intersect(lamp, vec3(0), direction, 0, HW_INFINITY, t);
    // The rounding of |c - b d| at this distance, in radii.
    const double slack = 8 * 6e-8 * distance / radius;
    if (std::abs(std::sqrt(miss2) - 1) > slack) CHECK(hit == (miss2 < 1));
    hits += hit;
    if (hit) CHECK(std::abs(t - b) <= radius * 1.001 + 2e-7 * b);
  }
  CHECK(hits > 2000);
  const LampShape lamp{HW_LAMP_SHAPE_SPHERE, {0, 0, 5}, {}, {}, 1};
  float t;
  CHECK(lamp_intersect(lamp, {0, 0, 5}, {0, 0, 1}, 0, 10, t));  // from the centre
  CHECK(t == doctest::Approx(1));
  CHECK(lamp_intersect(lamp, {0, 0, 0}, {0, 0, 1}, 4.5f, 10, t));  // the near side is before tmin
  CHECK(t == doctest::Approx(6));
  CHECK_FALSE(lamp_intersect(lamp, {0, 0, 0}, {0, 0, 1}, 0, 4, t));
  CHECK_FALSE(lamp_intersect(lamp, {0, 0, 7}, {0, 0, 1}, 0, 10, t));
  // A sheared rectangle: its corner at +x +y is (1.5, 1), outside the square of the same width and height.
  const LampShape sheared{HW_LAMP_SHAPE_RECTANGLE, {0, 0, 0}, {1, 0, 0}, {0.5f, 1, 0}, 0};
  CHECK(lamp_intersect(sheared, {1.4f, 0.95f, -1}, {0, 0, 1}, 0, 10, t));
  CHECK_FALSE(lamp_intersect(sheared, {1.4f, -0.95f, -1}, {0, 0, 1}, 0, 10, t));
  CHECK_FALSE(lamp_intersect(sheared, {0, 0, 1}, {0, 0, -1}, 0, 10, t));  // its dark side
  CHECK_FALSE(lamp_intersect(sheared, {0, 0, 1}, {1, 0, 0}, 0, 10, t));   // in its plane's direction
}

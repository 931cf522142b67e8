// SPDX-License-Identifier: Apache-2.0
// Rays a second of a Tracer beside a plain Embree loop.

#include "trace/benchmark.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>

#include "trace/embree_api.h"
#include "trace/tracer.h"
#include "trace/worker_pool.h"

namespace hw {
namespace {

struct Geometry {
  std::vector<float> positions;  // with a padding vertex at the end, which Embree may read
  std::vector<std::uint32_t> indices;
  std::size_t vertices() const { return positions.size() / 3 - 1; }
};

// A sphere of radius about 1 with bumps of two sizes, of n x n quads.
Geometry bumpy_sphere(std::uint32_t triangles) {
  const auto n = static_cast<std::uint32_t>(std::lround(std::sqrt(triangles / 2.0)));
  Geometry g;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i) {
      const double a = 2 * 3.14159265358979 * (i % n) / n, b = 3.14159265358979 * j / n;
      const double r = 1 + 0.1 * std::sin(9 * a) * std::sin(7 * b) + 0.03 * std::sin(40 * a + 3 * b) * std::sin(31 * b);
      for (const double x : {r * std::cos(a) * std::sin(b), r * std::sin(a) * std::sin(b), r * std::cos(b)})
        g.positions.push_back(static_cast<float>(x));
    }
  g.positions.insert(g.positions.end(), 3, 0.0f);
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t q = j * (n + 1) + i;
      for (const std::uint32_t k : {q, q + 1, q + n + 1, q + 1, q + n + 2, q + n + 1}) g.indices.push_back(k);
    }
  return g;
}

// PCG-XSH-RR (M. O'Neill, 2014): the same numbers with every standard library.
class Random {
 public:
  float operator()() {  // [-1, 1)
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    const auto x = static_cast<std::uint32_t>(((state_ >> 18) ^ state_) >> 27),
               rotation = static_cast<std::uint32_t>(state_ >> 59);
    return static_cast<float>((x >> rotation | x << (-rotation & 31)) >> 8) * (2.0f / 16777216.0f) - 1;
  }

 private:
  std::uint64_t state_ = 42;
};

std::vector<Ray> camera_rays(std::uint32_t count) {
  const auto width = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  std::vector<Ray> rays(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const float half = 0.5f * static_cast<float>(width), x = (static_cast<float>(i % width) - half) / half,
                y = (static_cast<float>(i / width) - half) / half;
    rays[i] = {{0, 0, 2.6f}, 0, glm::normalize(vec3(0.55f * x, 0.55f * y, -1)), HW_INFINITY, 0xFF};
  }
  return rays;
}

std::vector<Ray> random_rays(std::uint32_t count) {
  Random random;
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    vec3 direction;
    do {
      direction = vec3(random(), random(), random());
    } while (glm::dot(direction, direction) > 1 || glm::dot(direction, direction) < 1e-4f);
    ray = {vec3(random(), random(), random()) * 1.2f, 0, glm::normalize(direction), HW_INFINITY, 0xFF};
  }
  return rays;
}

// What a program that only had an array of rays to trace would do.
class PlainLoop {
 public:
  PlainLoop(const Geometry& g, int threads, RTCSceneFlags flags) : pool_(threads) {
    device_ = rtcNewDevice(threads > 0 ? ("threads=" + std::to_string(threads)).c_str() : nullptr);
    if (!device_) throw DeviceError("Embree could not start for the benchmark.");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, flags);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, g.positions.data(), 0, 12,
                               g.vertices());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, g.indices.data(), 0, 12,
                               g.indices.size() / 3);
    rtcSetGeometryMask(geometry, 0xFF);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) {
      release();
      throw OutOfMemory("Out of memory while building the benchmark's mesh.");
    }
  }
  ~PlainLoop() { release(); }
  PlainLoop(const PlainLoop&) = delete;
  PlainLoop& operator=(const PlainLoop&) = delete;

  void closest(const std::vector<Ray>& rays, std::vector<Hit>& hits) {
    pool_.run(static_cast<std::uint32_t>(rays.size()), 256, [&](std::uint32_t first, std::uint32_t last) {
      EmbreeQuery query(false);
      for (std::uint32_t i = first; i < last; ++i) {
        RTCRayHit rayhit;
        load(rays[i], rayhit.ray);
        rayhit.hit.geomID = rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        query.intersect1(scene_, &rayhit);
        hits[i] = {rayhit.ray.tfar, rayhit.hit.u, rayhit.hit.v, rayhit.hit.geomID, rayhit.hit.primID};
      }
    });
  }

  void any(const std::vector<Ray>& rays, std::vector<Hit>& hits) {
    pool_.run(static_cast<std::uint32_t>(rays.size()), 256, [&](std::uint32_t first, std::uint32_t last) {
      EmbreeQuery query(false);
      for (std::uint32_t i = first; i < last; ++i) {
        RTCRay ray;
        load(rays[i], ray);
        query.occluded1(scene_, &ray);
        hits[i].primitive = ray.tfar < 0;
      }
    });
  }

 private:
  static void load(const Ray& ray, RTCRay& out) {
    out = RTCRay{ray.origin.x,
                 ray.origin.y,
                 ray.origin.z,
                 ray.tmin,
                 ray.direction.x,
                 ray.direction.y,
                 ray.direction.z,
                 0,
                 ray.tmax,
                 ray.mask,
                 0,
                 0};
  }
  void release() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  WorkerPool pool_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace

std::vector<TracerBenchRow> tracer_benchmark(Device& device, const std::string& kind, int threads,
                                             const TracerBenchOptions& options) {
  const std::uint32_t count = std::max(64u, options.rays);
  Buffer queue(device, sizeof(QueueHeader) + 4ull * count, BufferUse::device, "benchmark queue");
  Buffer rays(device, sizeof(Ray) * std::size_t{count}, BufferUse::device, "benchmark rays");
  Buffer hits(device, sizeof(Hit) * std::size_t{count}, BufferUse::device, "benchmark hits");
  std::vector<std::uint32_t> words = {(count + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE, 1, 1, count, 1, 1};
  for (std::uint32_t i = 0; i < count; ++i) words.push_back(i);
  device.write(queue, 0, std::as_bytes(std::span(words)));
  Commands commands(device);
  std::vector<Hit> plain_hits(count);
  std::vector<TracerBenchRow> rows;
  for (const std::uint32_t triangles : options.triangles) {
    const Geometry geometry = bumpy_sphere(std::max(8u, triangles));
    const auto tracer = make_tracer(device, kind, threads);
    tracer->set_mesh(1,
                     {std::span(geometry.positions).first(3 * geometry.vertices()), geometry.indices, "bumpy sphere"});
    const TraceInstance instance{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 1, 0xFF, false};
    tracer->set_instances({&instance, 1});
    tracer->commit();
    PlainLoop plain(geometry, threads, RTC_SCENE_FLAG_ROBUST), fast(geometry, threads, RTC_SCENE_FLAG_NONE);
    for (const bool coherent : {true, false}) {
      const std::vector<Ray> source = coherent ? camera_rays(count) : random_rays(count);
      device.write(rays, 0, std::as_bytes(std::span(source)));
      const TraceArgs args{&queue, &rays, &hits, count};
      const std::array<std::function<void()>, 6> contestants = {
          [&] { tracer->closest(commands, args), commands.flush(); },
          [&] { tracer->any(commands, args), commands.flush(); },
          [&] { plain.closest(source, plain_hits); },
          [&] { plain.any(source, plain_hits); },
          [&] { fast.closest(source, plain_hits); },
          [&] { fast.any(source, plain_hits); }};
      std::array<std::vector<double>, 6> seconds;
      for (int repeat = -1; repeat < std::max(1, options.repeats); ++repeat)  // the first round warms the caches
        for (std::size_t k = 0; k < contestants.size(); ++k) {
          const auto start = std::chrono::steady_clock::now();
          contestants[k]();
          if (repeat >= 0)
            seconds[k].push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
      const auto mrays = [&](std::size_t k) {
        std::sort(seconds[k].begin(), seconds[k].end());
        return count / seconds[k][seconds[k].size() / 2] * 1e-6;
      };
      rows.push_back({static_cast<std::uint32_t>(geometry.indices.size() / 3), coherent, mrays(0), mrays(1), mrays(2),
                      mrays(3), mrays(4), mrays(5)});
    }
  }
  return rows;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// For the Tracer tests: a scene with its geometry, the brute-force answer in double precision, and a rig that runs
// rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "trace/tracer.h"

namespace hw::test {

struct MeshData {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  TraceMesh view(const std::string& name) const { return {positions, indices, name}; }
};

inline MeshData random_triangles(std::mt19937& random, int count, float size) {
  std::uniform_real_distribution<float> u(-1, 1);
  MeshData mesh;
  for (int i = 0; i < count; ++i) {
    const float c[3] = {u(random), u(random), u(random)};
    for (int corner = 0; corner < 3; ++corner) {
      mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size() / 3));
      for (const float x : c) mesh.positions.push_back(x + size * u(random));
    }
  }
  return mesh;
}

struct World {
  std::vector<MeshData> meshes;
  std::vector<TraceInstance> instances;
  std::vector<LampShape> lamps;
  void give(Tracer& tracer) const {
    for (std::size_t i = 0; i < meshes.size(); ++i) tracer.set_mesh(i, meshes[i].view("mesh " + std::to_string(i)));
    tracer.set_instances(instances);
    tracer.set_lamps(lamps);
    tracer.commit();
  }
};

struct Candidate {
  double t, u, v;
  std::uint32_t instance, primitive;
};

// All of a ray's hits with triangles and lamps, nearest first, in double precision (Möller and Trumbore's test in world
// space; a quadratic for spheres). Borderline hits (within `slack` of an edge or of the ends of the ray) are dropped
// when `slack` is negative and kept when it is positive: rays whose answers differ are not decided at single precision.
inline std::vector<Candidate> all_hits(const World& world, const Ray& ray, double slack) {
  using dvec3 = glm::dvec3;
  const dvec3 o(ray.origin), d(ray.direction);
  std::vector<Candidate> hits;
  const auto in_range = [&](double t) { return t > ray.tmin - slack && t < ray.tmax + slack; };
  for (std::uint32_t i = 0; i < world.instances.size(); ++i) {
    const TraceInstance& instance = world.instances[i];
    if (!(instance.mask & ray.mask & 0xFF)) continue;
    const float* m = instance.object_to_world;
    const auto point = [&](const MeshData& mesh, std::uint32_t vertex) {
      const float* p = &mesh.positions[3 * vertex];
      dvec3 r;
      for (int k = 0; k < 3; ++k)
        r[k] = double(m[4 * k]) * p[0] + double(m[4 * k + 1]) * p[1] + double(m[4 * k + 2]) * p[2] + m[4 * k + 3];
      return r;
    };
    const dvec3 cx(m[0], m[4], m[8]), cy(m[1], m[5], m[9]), cz(m[2], m[6], m[10]);
    if (std::abs(glm::dot(cx, glm::cross(cy, cz))) < 1e-12) continue;
    const MeshData& mesh = world.meshes[instance.mesh];
    for (std::uint32_t p = 0; p < mesh.indices.size() / 3; ++p) {
      const dvec3 a = point(mesh, mesh.indices[3 * p]), b = point(mesh, mesh.indices[3 * p + 1]),
                  c = point(mesh, mesh.indices[3 * p + 2]);
      const dvec3 e1 = b - a, e2 = c - a, q = glm::cross(d, e2);
      const double det = glm::dot(e1, q);
      if (det == 0) continue;
      const dvec3 s = o - a;
      const double u = glm::dot(s, q) / det, v = glm::dot(d, glm::cross(s, e1)) / det,
                   t = glm::dot(e2, glm::cross(s, e1)) / det;
      if (u > -slack && v > -slack && u + v < 1 + slack && in_range(t)) hits.push_back({t, u, v, i, p});
    }
  }
  for (std::uint32_t i = 0; (ray.mask & HW_MASK_LAMP) && i < world.lamps.size(); ++i) {
    const LampShape& lamp = world.lamps[i];
    const dvec3 c(lamp.center), ax(lamp.axis_x), ay(lamp.axis_y);
    if (lamp.shape == HW_LAMP_SHAPE_SPHERE) {
      const dvec3 s = o - c;
      const double r = lamp.radius * (1 + slack), b = glm::dot(s, d), disc = b * b - glm::dot(s, s) + r * r;
      if (disc < 0) continue;
      for (const double t : {-b - std::sqrt(disc), -b + std::sqrt(disc)})
        if (in_range(t)) hits.push_back({t, 0, 0, HW_LAMP_INSTANCE, i});
    } else if (lamp.shape == HW_LAMP_SHAPE_FACING_DISK) {
      const dvec3 s = c - o;
      const double t = glm::dot(s, s) / glm::dot(s, d);
      const dvec3 p = o + d * t - c;
      if (glm::dot(s, d) > 0 && in_range(t) && glm::length(p) < lamp.radius * (1 + slack))
        hits.push_back({t, 0, 0, HW_LAMP_INSTANCE, i});
    } else if (lamp.shape != HW_LAMP_SHAPE_NONE) {
      const dvec3 n = glm::cross(ax, ay);
      if (glm::dot(d, n) <= 0) continue;
      const double t = glm::dot(c - o, n) / glm::dot(d, n);
      if (!in_range(t)) continue;
      const dvec3 p = o + d * t - c;
      const double u = glm::dot(p, ax) / glm::dot(ax, ax), v = glm::dot(p, ay) / glm::dot(ay, ay);
      const bool inside = lamp.shape == HW_LAMP_SHAPE_ELLIPSE ? u * u + v * v < 1 + slack
                                                              : std::max(std::abs(u), std::abs(v)) < 1 + slack;
      if (inside) hits.push_back({t, 0, 0, HW_LAMP_INSTANCE, i});
    }
  }
  std::sort(hits.begin(), hits.end(), [](const Candidate& a, const Candidate& b) { return a.t < b.t; });
  return hits;
}

// Rays of unit direction from within a box about the origin.
inline std::vector<Ray> random_rays(std::mt19937& random, int count, float box, std::uint32_t mask = 0xFF) {
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    vec3 d(u(random), u(random), u(random));
    if (glm::length(d) < 1e-3f) d = vec3(1, 0, 0);
    rays.push_back({vec3(u(random), u(random), u(random)) * box, 0, glm::normalize(d), HW_INFINITY, mask});
  }
  return rays;
}

// Buffers for up to `capacity` rays; every ray's path id is its place, and the queue lists them backwards.
class Rig {
 public:
  Rig(Device& device, std::uint32_t capacity)
      : device_(device),
        capacity_(capacity),
        queue_(device, sizeof(QueueHeader) + 4 * capacity, BufferUse::device, "test queue"),
        rays_(device, sizeof(Ray) * capacity, BufferUse::device, "test rays"),
        hits_(device, sizeof(Hit) * capacity, BufferUse::device, "test hits"),
        commands_(device) {}

  std::vector<Hit> closest(Tracer& tracer, const std::vector<Ray>& rays) {
    std::vector<Hit> result(rays.size());
    put(rays);
    tracer.closest(commands_, {&queue_, &rays_, &hits_, capacity_});
    commands_.flush();
    device_.read(hits_, 0, std::as_writable_bytes(std::span(result)));
    return result;
  }

  std::vector<std::uint32_t> any(Tracer& tracer, const std::vector<Ray>& rays) {
    std::vector<std::uint32_t> result(rays.size(), 7);
    put(rays);
    tracer.any(commands_, {&queue_, &rays_, &hits_, capacity_});
    commands_.flush();
    device_.read(hits_, 0, std::as_writable_bytes(std::span(result)));
    return result;
  }

 private:
  void put(const std::vector<Ray>& rays) {
    const auto count = static_cast<std::uint32_t>(rays.size());
    std::vector<std::uint32_t> words = {(count + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE, 1, 1, count, 1, 1};
    for (std::uint32_t i = count; i-- > 0;) words.push_back(i);
    device_.write(queue_, 0, std::as_bytes(std::span(words)));
    device_.write(rays_, 0, std::as_bytes(std::span(rays)));
  }

  Device& device_;
  std::uint32_t capacity_;
  Buffer queue_, rays_, hits_;
  Commands commands_;
};

}  // namespace hw::test

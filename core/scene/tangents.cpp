// SPDX-License-Identifier: Apache-2.0
// In double throughout, so that no finite position or UV overflows. Corners are matched by hash, each thread owning the
// hashes of one range and going through all corners in their order: sums do not depend on the threads.
#include "scene/tangents.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "threads/parts.h"

namespace hw {
namespace {

constexpr std::size_t kTrianglesPerThread = 1 << 12;  // below this a thread costs more than it saves
constexpr std::size_t kMostRanges = 16;               // each goes through all corners

struct Vec {
  double x = 0, y = 0, z = 0;
};
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec unit(Vec v) {
  const double length = std::sqrt(dot(v, v));
  return length > 0 ? v * (1 / length) : Vec{};
}

// Whether a triangle's map keeps its orientation. One without area goes with whichever its neighbours at the corner
// have.
enum Handedness : std::uint32_t { kTurned = 0, kKept = 1, kEmpty = 2 };

struct Corner {
  std::uint32_t tag = 0;  // hash of what it must agree in; the two last bits: Handedness
  float share[3] = {};    // of the tangent
  Handedness handedness() const { return static_cast<Handedness>(tag & 3u); }
};

// Position, normal and UV, as bits in which -0 is 0.
using Key = std::array<std::uint32_t, 8>;

std::uint32_t hash(const Key& key) {
  std::uint64_t h = 0x9e3779b97f4a7c15u;
  for (std::size_t i = 0; i < key.size(); i += 2) {
    h = (h ^ (key[i] | std::uint64_t{key[i + 1]} << 32)) * 0xff51afd7ed558ccdu;
    h ^= h >> 32;
  }
  return static_cast<std::uint32_t>(h ^ h >> 15);
}

class Mesh {
 public:
  explicit Mesh(const TangentInput& input) : in_(input) {}

  std::size_t corner(std::size_t i) const {
    if (in_.corners_in_order) return i;
    return in_.tri_corners.empty() ? in_.tri_vertices[i] : in_.tri_corners[i];
  }
  Vec position(std::size_t i) const { return vec(in_.positions, in_.tri_vertices[i]); }
  const float* uv(std::size_t i) const {
    return &in_.uv[(in_.uv_at_vertices ? in_.tri_vertices[i] : corner(i)) * in_.uv_components];
  }
  Vec face_normal(std::size_t triangle) const {
    const Vec a = position(3 * triangle);
    return unit(cross(position(3 * triangle + 1) - a, position(3 * triangle + 2) - a));
  }
  Vec normal(std::size_t i) const { return in_.normals.empty() ? face_normal(i / 3) : vec(in_.normals, corner(i)); }

  Key key(std::size_t i, Vec normal) const {
    const float* p = &in_.positions[std::size_t{in_.tri_vertices[i]} * 3];
    const float values[8] = {p[0], p[1], p[2], float(normal.x), float(normal.y), float(normal.z), uv(i)[0], uv(i)[1]};
    Key key;
    for (std::size_t k = 0; k < 8; ++k) key[k] = std::bit_cast<std::uint32_t>(values[k] + 0.0f);
    return key;
  }

  // Fills the triangle's three corners.
  void triangle(std::size_t t, Corner* corners) const;

 private:
  static Vec vec(std::span<const float> values, std::size_t element) {
    const float* v = &values[3 * element];
    return {v[0], v[1], v[2]};
  }

  const TangentInput& in_;
};

void Mesh::triangle(std::size_t t, Corner* corners) const {
  Vec p[3];
  for (std::size_t k = 0; k < 3; ++k) p[k] = position(3 * t + k);
  const float *uv0 = uv(3 * t), *uv1 = uv(3 * t + 1), *uv2 = uv(3 * t + 2);
  const double d1[2] = {double(uv1[0]) - uv0[0], double(uv1[1]) - uv0[1]};
  const double d2[2] = {double(uv2[0]) - uv0[0], double(uv2[1]) - uv0[1]};
  const double area = d1[0] * d2[1] - d1[1] * d2[0];
  const Vec grows = (p[1] - p[0]) * d2[1] - (p[2] - p[0]) * d1[1];  // the way u grows, or the other
  const Vec tangent = area == 0 ? Vec{} : unit(grows) * (area > 0 ? 1 : -1);
  const bool empty = dot(tangent, tangent) == 0;
  const Handedness handedness = empty ? kEmpty : area > 0 ? kKept : kTurned;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = 3 * t + k;
    const Vec n = normal(i);
    const double square = dot(n, n);
    const auto in_plane = [&](Vec v) { return square > 0 ? v - n * (dot(v, n) / square) : v; };
    Corner& corner = corners[k];
    corner.tag = (hash(key(i, n)) & ~3u) | handedness;
    if (empty) continue;
    const Vec next = in_plane(p[(k + 1) % 3] - p[k]), last = in_plane(p[(k + 2) % 3] - p[k]);
    const double lengths = std::sqrt(dot(next, next)) * std::sqrt(dot(last, last));
    const double angle =
        lengths > 0 ? std::acos(std::clamp(dot(next, last) / lengths, -1.0, 1.0)) : std::numbers::pi / 2;
    const Vec share = unit(in_plane(tangent)) * angle;
    corner.share[0] = float(share.x), corner.share[1] = float(share.y), corner.share[2] = float(share.z);
  }
}

// The corners whose hashes lie in one range: where they agree, and the tangent that they share.
class Range {
 public:
  // Writes the group of each of its corners.
  void gather(const Mesh& mesh, std::span<const Corner> corners, std::size_t number, std::size_t count,
              std::span<std::uint32_t> group_of) {
    const auto mine = [&](std::size_t i) { return range_of(corners[i], count) == number; };
    slots_.assign(64, kFree);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!mine(i)) continue;
      const std::uint32_t place = place_of(mesh, corners, i);
      places_[place].has |= 1u << corners[i].handedness();
      group_of[i] = place;
    }
    std::vector<Vec> sums(2 * places_.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!mine(i)) continue;
      const Place& place = places_[group_of[i]];
      const bool has_kept = place.has >> kKept & 1, has_turned = place.has >> kTurned & 1;
      const Handedness own = corners[i].handedness();
      const bool kept = own == kEmpty ? has_kept || !has_turned : own == kKept;
      const std::uint32_t group = 2 * group_of[i] + (kept ? 1 : 0);
      const float* share = corners[i].share;
      sums[group] = sums[group] + Vec{share[0], share[1], share[2]};
      group_of[i] = group;
    }
    slots_ = {}, places_ = {};
    tangents_.reserve(sums.size());
    for (std::size_t g = 0; g < sums.size(); ++g) {
      const Vec tangent = unit(sums[g]);
      tangents_.push_back({float(tangent.x), float(tangent.y), float(tangent.z), g % 2 ? 1.0f : -1.0f});
    }
  }

  const std::array<float, 4>& tangent(std::uint32_t group) const { return tangents_[group]; }

  static std::size_t range_of(const Corner& corner, std::size_t count) {
    return static_cast<std::size_t>(std::uint64_t{corner.tag >> 2} * count >> 30);
  }

 private:
  static constexpr std::uint32_t kFree = 0xffffffffu;

  struct Place {
    std::uint32_t first;    // corner
    std::uint32_t has = 0;  // bits of Handedness
  };

  std::uint32_t place_of(const Mesh& mesh, std::span<const Corner> corners, std::size_t i) {
    if (2 * places_.size() >= slots_.size()) grow(corners);
    const Key key = mesh.key(i, mesh.normal(i));
    const std::uint32_t hash = corners[i].tag >> 2;
    for (std::size_t slot = hash;; ++slot) {
      std::uint32_t& place = slots_[slot & (slots_.size() - 1)];
      if (place == kFree) {
        place = static_cast<std::uint32_t>(places_.size());
        places_.push_back({static_cast<std::uint32_t>(i)});
        return place;
      }
      const std::uint32_t first = places_[place].first;
      if (corners[first].tag >> 2 == hash && mesh.key(first, mesh.normal(first)) == key) return place;
    }
  }

  void grow(std::span<const Corner> corners) {
    slots_.assign(4 * slots_.size(), kFree);
    for (std::size_t p = 0; p < places_.size(); ++p) {
      std::size_t slot = corners[places_[p].first].tag >> 2;
      while (slots_[slot & (slots_.size() - 1)] != kFree) ++slot;
      slots_[slot & (slots_.size() - 1)] = static_cast<std::uint32_t>(p);
    }
  }

  std::vector<std::uint32_t> slots_;  // places, by hash; a power of two
  std::vector<Place> places_;
  std::vector<std::array<float, 4>> tangents_;
};

}  // namespace

std::vector<float> corner_tangents(const TangentInput& input, int threads) {
  const Mesh mesh(input);
  const std::size_t triangles = input.tri_vertices.size() / 3;
  threads = thread_count(threads);
  std::vector<Corner> corners(3 * triangles);
  in_parts(threads, kTrianglesPerThread, 0, triangles, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) mesh.triangle(t, &corners[3 * t]);
  });
  std::vector<std::uint32_t> group_of(corners.size());
  std::vector<Range> ranges(
      std::clamp<std::size_t>(triangles / kTrianglesPerThread, 1, std::min<std::size_t>(threads, kMostRanges)));
  in_turns(threads, ranges.size(), [&](std::size_t r) { ranges[r].gather(mesh, corners, r, ranges.size(), group_of); });
  std::vector<float> result(4 * input.corner_count);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& tangent = ranges[Range::range_of(corners[i], ranges.size())].tangent(group_of[i]);
    std::copy(tangent.begin(), tangent.end(), &result[4 * mesh.corner(i)]);
  }
  return result;
}

}  // namespace hw

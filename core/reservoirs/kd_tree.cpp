// SPDX-License-Identifier: Apache-2.0
// Top-down median splits, subtrees on threads of their own.
#include "reservoirs/kd_tree.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <limits>
#include <thread>

#include "lib/kd_tree.h"
#include "threads/both.h"

namespace hw {

namespace {

// Below this a thread costs more than it saves.
constexpr std::size_t kPointsPerThread = 1 << 14;

// Split coordinates have two zero bits and are not denormal, which devices may take for zero. The largest such number
// that is at most x (finite):
float split_below(float x) {
  if (std::abs(x) < FLT_MIN) return x < 0 ? -FLT_MIN : 0.0f;
  const uint bits = floatBitsToUint(x);
  return uintBitsToFloat((x < 0 ? bits + 3 : bits) &
                         ~3u);  // below the largest float is -infinity: all points are above
}

// ... and the least one above x.
float split_above(float x) {
  const float below = split_below(x);
  if (below == 0) return FLT_MIN;
  if (below == -FLT_MIN) return 0;
  const uint bits = floatBitsToUint(below);
  return uintBitsToFloat(below > 0 ? bits + 4 : bits - 4);
}

class Builder {
 public:
  Builder(std::uint32_t* words, std::uint32_t depth) : words_(words), depth_(depth) {}

  void build(std::span<vec3> points, std::uint32_t node, std::uint32_t level, int threads) const {
    if (level == depth_) return;
    const std::size_t below = split(points, words_[node]);
    const auto left = [&](int n) { build(points.first(below), 2 * node + 1, level + 1, n); };
    const auto right = [&](int n) { build(points.subspan(below), 2 * node + 2, level + 1, n); };
    both(points.size() > kPointsPerThread ? threads : 1, left, right);
  }

 private:
  // Chooses a node's split and partitions its points by it, as traversal will; returns how many are below.
  static std::size_t split(std::span<vec3> points, std::uint32_t& word) {
    word = 0;
    if (points.empty()) return 0;
    if (points.size() == 1) {  // nothing to tell apart: above
      word = kd_node(split_below(points[0].x), 0);
      return 0;
    }
    const int axis = widest_axis(points);
    const auto less = [axis](const vec3& a, const vec3& b) { return a[axis] < b[axis]; };
    const auto middle = points.begin() + std::ptrdiff_t(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(), less);
    const float high = (*middle)[axis];
    const float low = (*std::max_element(points.begin(), middle, less))[axis];
    // Between the two halves if there is room, else on either side of the points that coincide there.
    float at = split_below(0.5f * low + 0.5f * high);
    if (at <= low) at = split_below(high);
    if (at <= low) {
      const float other = split_above(high);
      const auto imbalance = [&](float s) {
        const auto n = std::count_if(points.begin(), points.end(), [&](const vec3& p) { return p[axis] < s; });
        return std::abs(2 * n - std::ptrdiff_t(points.size()));
      };
      if (imbalance(other) < imbalance(at)) at = other;
    }
    word = kd_node(at, std::uint32_t(axis));
    return std::size_t(std::partition(points.begin(), points.end(), [&](const vec3& p) { return !kd_above(word, p); }) -
                       points.begin());
  }

  // The axis of the largest extent; of equal ones the first.
  static int widest_axis(std::span<const vec3> points) {
    vec3 low = points[0], high = points[0];
    for (const vec3& p : points) low = min(low, p), high = max(high, p);
    const glm::dvec3 extent = glm::dvec3(high) - glm::dvec3(low);
    const int xy = extent.x >= extent.y ? 0 : 1;
    return extent[xy] >= extent.z ? xy : 2;
  }

  std::uint32_t* words_;
  std::uint32_t depth_;
};

}  // namespace

std::uint32_t kd_tree_depth(std::size_t points, std::uint32_t points_per_leaf) {
  const std::size_t per_leaf = std::max(points_per_leaf, 1u);
  const std::size_t leaves = points / per_leaf + (points % per_leaf != 0);
  return std::min(leaves < 2 ? 0u : std::uint32_t(std::bit_width(leaves - 1)), HW_KD_MAX_DEPTH);
}

KdTreeNodes build_kd_tree(std::span<const vec3> points, std::uint32_t points_per_leaf, int threads) {
  std::vector<vec3> finite;
  finite.reserve(points.size());
  for (const vec3& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) finite.push_back(p);
  KdTreeNodes t;
  t.points = finite.size();
  t.dropped = points.size() - finite.size();
  t.depth = kd_tree_depth(t.points, points_per_leaf);
  t.leaf_count = 1u << t.depth;
  t.words.resize(t.leaf_count - 1);
  if (threads <= 0) threads = int(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
  Builder(t.words.data(), t.depth).build(finite, 0, 0, threads);
  return t;
}

}  // namespace hw

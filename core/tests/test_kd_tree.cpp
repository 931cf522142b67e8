// SPDX-License-Identifier: Apache-2.0
// The k-d tree of reservoirs: leaves hold what they promise, whatever the points; neighbours are drawn uniformly.
#include <doctest/doctest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "lib/kd_tree.h"
#include "lib/sampler.h"
#include "reservoirs/kd_tree.h"

using namespace hw;

namespace {

std::vector<vec3> cloud(std::size_t n, uint seed, vec3 scale = vec3(1), vec3 at = vec3(0)) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<vec3> points(n);
  for (vec3& p : points) {
    const float x = normal(random), y = normal(random), z = normal(random);
    p = at + scale * vec3(x, y, z);
  }
  return points;
}

std::vector<std::size_t> leaf_counts(const KdTreeNodes& t, const std::vector<vec3>& points) {
  std::vector<std::size_t> counts(t.leaf_count, 0);
  for (const vec3& p : points) {
    const uint leaf = kd_leaf(t.header(), p);
    REQUIRE(leaf < t.leaf_count);
    ++counts[leaf];
  }
  return counts;
}

// A leaf's box by the splits on the way to it, from the leaf upwards: written apart from the traversal.
bool inside_leaf(const KdTreeNodes& t, uint leaf, vec3 p) {
  for (uint i = leaf + t.leaf_count - 1; i > 0; i = (i - 1) / 2) {
    const uint word = t.words[(i - 1) / 2];
    const bool above = i % 2 == 0;
    if ((p[word & 3u] >= uintBitsToFloat(word & ~3u)) != above) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("depth is that of the fewest leaves which hold the points") {
  CHECK(kd_tree_depth(0, 8) == 0);
  CHECK(kd_tree_depth(1, 1) == 0);
  CHECK(kd_tree_depth(8, 8) == 0);
  CHECK(kd_tree_depth(9, 8) == 1);
  CHECK(kd_tree_depth(16, 8) == 1);
  CHECK(kd_tree_depth(17, 8) == 2);
  CHECK(kd_tree_depth(1000, 1) == 10);
  CHECK(kd_tree_depth(1024, 1) == 10);
  CHECK(kd_tree_depth(1025, 0) == 11);
  CHECK(kd_tree_depth(std::size_t(1) << 40, 1) == HW_KD_MAX_DEPTH);
  CHECK(kd_tree_depth(~std::size_t(0), ~0u) == HW_KD_MAX_DEPTH);
}

TEST_CASE("every point falls into its leaf, and no leaf holds more than was asked") {
  for (std::size_t n : {1, 2, 3, 7, 100, 1000, 4096, 50000}) {
    for (uint per_leaf : {1u, 3u, 8u, 32u}) {
      CAPTURE(n);
      CAPTURE(per_leaf);
      const std::vector<vec3> points = cloud(n, uint(n), vec3(3, 1, 20), vec3(5, -100, 0));
      const KdTreeNodes t = build_kd_tree(points, per_leaf);
      REQUIRE(t.points == n);
      REQUIRE(t.words.size() + 1 == t.leaf_count);
      const std::vector<std::size_t> counts = leaf_counts(t, points);
      CHECK(*std::max_element(counts.begin(), counts.end()) <= per_leaf);
      const std::size_t least = *std::min_element(counts.begin(), counts.end());
      CHECK(least >= n / t.leaf_count);
      for (const vec3& p : points) REQUIRE(inside_leaf(t, kd_leaf(t.header(), p), p));
    }
  }
}

TEST_CASE("cells are split where their points extend furthest") {
  const KdTreeNodes t = build_kd_tree(cloud(4096, 5, vec3(1, 30, 0.01f)), 2048);
  REQUIRE(t.depth == 1);
  CHECK(kd_axis(t.words[0]) == 1);
  CHECK(std::abs(kd_split(t.words[0])) < 3);
}

TEST_CASE("points that cannot be told apart, extreme and invalid ones do no harm") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const KdTreeNodes none = build_kd_tree({}, 8);
  CHECK(none.leaf_count == 1);
  CHECK(kd_leaf(none.header(), vec3(1, 2, 3)) == 0);
  CHECK(kd_neighbour(none.header(), 0, 10, 0.5f) == HW_NONE);

  std::vector<vec3> points = cloud(500, 2);
  for (int i = 0; i < 100; ++i) points.insert(points.begin() + 5 * i, i % 2 ? vec3(0, nan, 0) : vec3(-inf, 0, inf));
  const KdTreeNodes dropped = build_kd_tree(points, 8);
  CHECK(dropped.points == 500);
  CHECK(dropped.dropped == 100);
  CHECK(dropped.words == build_kd_tree(cloud(500, 2), 8).words);
  for (const vec3& p : points) CHECK(kd_leaf(dropped.header(), p) < dropped.leaf_count);

  // All alike: all in one leaf. Half alike: they stay together, and the others' leaves keep the promise.
  for (float x : {0.0f, 1.0f, -1.0f, 1e-40f, -1e-40f, FLT_MIN, -FLT_MIN, FLT_MAX, -FLT_MAX, 0.1f, -0.1f}) {
    CAPTURE(x);
    const std::vector<vec3> alike(1000, vec3(x, 2, 3));
    const KdTreeNodes t = build_kd_tree(alike, 8);
    std::vector<std::size_t> counts = leaf_counts(t, alike);
    CHECK(*std::max_element(counts.begin(), counts.end()) == 1000);
    std::vector<vec3> mixed = alike;
    for (const vec3& p : cloud(1000, 4)) mixed.push_back(p);
    const KdTreeNodes m = build_kd_tree(mixed, 8);
    counts = leaf_counts(m, mixed);
    for (uint word : m.words) REQUIRE((kd_split(word) == 0 || std::abs(kd_split(word)) >= FLT_MIN));
    for (const vec3& p : mixed) REQUIRE(inside_leaf(m, kd_leaf(m.header(), p), p));
    std::sort(counts.rbegin(), counts.rend());
    CHECK(counts[0] >= 1000);
    CHECK(counts[1] <= 256);
  }
  // Two values, with every sign and size beside each other, are told apart where four units in the last place fit.
  const float values[] = {-FLT_MAX, -1e30f, -1, -0.9999f, -FLT_MIN, 0, FLT_MIN, 1e-20f, 1, 1.00001f, 1e30f, FLT_MAX};
  for (float a : values) {
    for (float b : values) {
      if (a == b) continue;
      CAPTURE(a);
      CAPTURE(b);
      const std::vector<vec3> two = {vec3(0, 0, a), vec3(0, 0, b)};
      const KdTreeNodes t = build_kd_tree(two, 1);
      CHECK(kd_leaf(t.header(), two[0]) == (a < b ? 0 : 1));
      CHECK(kd_leaf(t.header(), two[1]) == (a < b ? 1 : 0));
    }
  }
  std::mt19937 random(9);
  for (int n = 0; n < 1000; ++n) {
    const uint bits = uint(random() % 0x7E000000u) + 0x00800000u, sign = n % 2 ? 0x80000000u : 0u;
    const std::vector<vec3> two = {vec3(uintBitsToFloat(bits | sign), 0, 0),
                                   vec3(uintBitsToFloat((bits + 4) | sign), 0, 0)};
    const KdTreeNodes t = build_kd_tree(two, 1);
    CHECK(kd_leaf(t.header(), two[0]) + kd_leaf(t.header(), two[1]) == 1);
  }
  const KdTreeNodes tiny = build_kd_tree(std::vector<vec3>{vec3(-FLT_MIN), vec3(-FLT_MIN), vec3(-FLT_MIN), vec3(1)}, 3);
  CHECK(kd_split(tiny.words[0]) == 0);  // not the denormal next to them
  // A third alike, as the least, the middle or the greatest: the split goes to whichever side is evener.
  for (float x : {-9.0f, 0.0f, 9.0f}) {
    std::vector<vec3> third(1000, vec3(x, 0, 0));
    for (const vec3& p : cloud(2000, 4)) third.push_back(p);
    const KdTreeNodes t = build_kd_tree(third, 1500);
    REQUIRE(t.depth == 1);
    for (std::size_t c : leaf_counts(t, third)) CHECK(c >= 1000);
  }
}

TEST_CASE("the tree is the same for any number of threads and any order of points") {
  std::vector<vec3> points = cloud(200000, 6, vec3(4, 2, 1));
  for (std::size_t i = 0; i < points.size(); i += 3) points[i].z = std::round(points[i].z);  // many equal ones
  const KdTreeNodes one = build_kd_tree(points, 16, 1);
  for (int threads : {2, 3, 8, 0}) CHECK(build_kd_tree(points, 16, threads).words == one.words);
  std::shuffle(points.begin(), points.end(), std::mt19937(1));
  CHECK(build_kd_tree(points, 16, 4).words == one.words);
}

TEST_CASE("a neighbour is any other leaf of the subtree above, with equal odds") {
  const KdTreeNodes t = build_kd_tree(cloud(2048, 8), 2);
  const KdTree h = t.header();
  REQUIRE(t.leaf_count == 1024);
  std::mt19937 random(3);
  for (uint ascension : {0u, 1u, 2u, 5u, 10u, 100u}) {
    const uint size = 1u << std::min(ascension, 10u);
    for (uint leaf : {0u, 1u, 517u, 1023u}) {
      CAPTURE(ascension);
      CAPTURE(leaf);
      if (size == 1) {
        CHECK(kd_neighbour(h, leaf, ascension, 0.3f) == HW_NONE);
        continue;
      }
      std::vector<int> counts(1024, 0);
      const int n = 200 * int(size);
      for (int i = 0; i < n; ++i) ++counts[kd_neighbour(h, leaf, ascension, sampler_to_float(uint(random())))];
      double chi = 0;
      const double expected = n / double(size - 1);
      for (uint i = 0; i < 1024; ++i) {
        if (i == leaf || i / size != leaf / size) {
          CHECK(counts[i] == 0);
        } else {
          chi += (counts[i] - expected) * (counts[i] - expected) / expected;
        }
      }
      const double freedom = size - 2.0;
      CHECK(std::abs(chi - freedom) <= 4.5 * std::sqrt(2 * freedom) + 1e-9);
    }
  }
  CHECK(kd_neighbour(h, 1, 10, 0.0f) == 0);
  CHECK(kd_neighbour(h, 1, 10, 0.99999994f) == 1023);
  CHECK(kd_neighbour(h, 1, 10, 1.0f) == 1023);
}

TEST_CASE("several draws differ, and each leaf is among them equally often") {
  const KdTreeNodes t = build_kd_tree(cloud(2048, 8), 2);
  const KdTree h = t.header();
  std::mt19937 random(4);
  for (uint ascension : {1u, 2u, 3u, 5u, 8u, 10u}) {
    const uint others = (1u << ascension) - 1;
    for (uint k : {1u, 2u, 3u, 5u, 7u, 31u, 255u}) {
      CAPTURE(ascension);
      CAPTURE(k);
      const uint leaf = 300;
      const int rounds = 4000;
      std::vector<int> counts(1024, 0);
      for (int n = 0; n < rounds; ++n) {
        // The ends of the range too, where rounding would show.
        const float u = n < 2 ? (n == 0 ? 0.0f : 0.99999994f) : sampler_to_float(uint(random()));
        std::set<uint> drawn;
        for (uint i = 0; i < k; ++i) {
          const uint x = kd_neighbour_of(h, leaf, ascension, i, k, u);
          REQUIRE(x != leaf);
          REQUIRE((x >> ascension) == (leaf >> ascension));
          drawn.insert(x);
          ++counts[x];
        }
        REQUIRE(drawn.size() == std::min(k, others));
      }
      const double expected = rounds * double(k) / others;
      for (uint i = (leaf >> ascension) << ascension; i < ((leaf >> ascension) + 1) << ascension; ++i)
        if (i != leaf) CHECK(std::abs(counts[i] - expected) < 5 * std::sqrt(double(rounds) / 4 + 1) + 2);
    }
  }
}

// SPDX-License-Identifier: Apache-2.0
// The tree that follows its scene: whatever comes and goes, every point has its leaf, ranges are those of the leaves
// below, neighbours are drawn uniformly, and no call changes more than it may.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "lib/following_tree.h"
#include "reservoirs/following_tree.h"

using namespace hw;

namespace {

std::vector<vec3> cloud(std::size_t n, uint seed, vec3 at) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<vec3> points(n);
  for (vec3& p : points) {
    const float x = u(random), y = u(random);
    p = at + vec3(x, y, 0.1f * x * y);
  }
  return points;
}

// What a pass over `points` leaves in each slot: as stages/record_survey.comp, with its last and first point.
void pass(const FollowingTreeHost& tree, const std::vector<vec3>& points, uint number, std::vector<LeafSurvey>& seen) {
  std::set<uint> touched;
  for (const vec3& p : points) {
    LeafSurvey& s = seen[following_leaf(tree.header(), p).link];
    if (touched.insert(following_leaf(tree.header(), p).link).second) s = {p, number, p, 0};
    s.position = p;
    ++s.load;
  }
}

// Ranks, ranges and slots agree with a walk over the tree.
void check(const FollowingTreeHost& tree) {
  std::vector<uint> walked;
  std::set<uint> slots;
  auto walk = [&](auto&& self, uint node, uint depth) -> void {
    const FollowingNode n = tree.nodes()[node];
    const uint first = uint(walked.size());
    REQUIRE(depth <= HW_FOLLOWING_MAX_DEPTH);
    if (following_is_leaf(n)) {
      walked.push_back(n.link);
      CHECK(slots.insert(n.link).second);
    } else {
      self(self, n.link, depth + 1);
      self(self, n.link + 1, depth + 1);
    }
    CHECK(n.first == first);
    CHECK(following_leaves(n) == walked.size() - first);
  };
  walk(walk, 0, 0);
  CHECK(walked == tree.order());
  CHECK(*std::max_element(walked.begin(), walked.end()) < tree.capacity());
}

std::size_t most_in_a_leaf(const FollowingTreeHost& tree, const std::vector<vec3>& points) {
  std::map<uint, std::size_t> counts;
  for (const vec3& p : points) ++counts[following_leaf(tree.header(), p).link];
  std::size_t most = 0;
  for (const auto& [slot, count] : counts) most = std::max(most, count);
  return most;
}

constexpr uint kPerLeaf = 4;
FollowingTreeHost::Rules rules(uint pass, uint budget = 1u << 14) { return {4 * kPerLeaf, pass, 16, budget}; }

}  // namespace

TEST_CASE("a following tree begins as the perfect one") {
  const std::vector<vec3> points = cloud(1000, 1, vec3(0));
  const KdTreeNodes built = build_kd_tree(points, kPerLeaf, 1);
  const FollowingTreeHost tree(built, 400);
  check(tree);
  CHECK(tree.leaves() == built.leaf_count);
  for (const vec3& p : points) {
    const FollowingNode leaf = following_leaf(tree.header(), p);
    CHECK(leaf.link == kd_leaf(built.header(), p));
    CHECK(leaf.first == leaf.link);
  }
}

TEST_CASE("a following tree of no points has one leaf, and keeps it") {
  FollowingTreeHost tree(build_kd_tree({}, kPerLeaf, 1), 1);
  std::vector<LeafSurvey> seen(tree.capacity(), LeafSurvey{});
  CHECK(!tree.follow(seen, rules(100)));
  check(tree);
  seen[0] = {vec3(1), 100, vec3(0), 1000};  // crowded, and no slot is free
  CHECK(!tree.follow(seen, rules(100)));
  check(tree);
}

TEST_CASE("the tree follows surfaces to another place, and leaves the old one") {
  const std::vector<vec3> before = cloud(4000, 2, vec3(0)), after = cloud(4000, 3, vec3(50, 3, 0));
  FollowingTreeHost tree(build_kd_tree(before, kPerLeaf, 1), 1280);
  std::vector<LeafSurvey> seen(tree.capacity(), LeafSurvey{});
  uint number = 1;
  pass(tree, before, number, seen);
  CHECK(!tree.follow(seen, rules(number)));
  pass(tree, after, ++number, seen);
  CHECK(FollowingTreeHost::outgrown(seen, rules(number)));
  const std::size_t crowd = most_in_a_leaf(tree, after);
  REQUIRE(crowd > 100);
  for (int i = 0; i < 40; ++i) {
    tree.follow(seen, rules(number, 256));
    check(tree);
    pass(tree, after, ++number, seen);
  }
  CHECK(!FollowingTreeHost::outgrown(seen, rules(number)));
  CHECK(most_in_a_leaf(tree, after) <= 4 * kPerLeaf);
  CHECK(most_in_a_leaf(tree, before) > 100);  // nobody looks there any more
  // Nothing changes any more where nothing moves.
  CHECK(!tree.follow(seen, rules(number)));
}

TEST_CASE("no call changes more than it may") {
  const std::vector<vec3> before = cloud(4000, 4, vec3(0)), after = cloud(4000, 5, vec3(9, 0, 0));
  FollowingTreeHost tree(build_kd_tree(before, kPerLeaf, 1), 1280);
  std::vector<LeafSurvey> seen(tree.capacity(), LeafSurvey{});
  for (uint number = 20; number < 60; ++number) {
    pass(tree, after, number, seen);
    const uint leaves = tree.leaves();
    tree.follow(seen, rules(number, 3));
    CHECK(tree.leaves() + 3 >= leaves);
    CHECK(tree.leaves() <= leaves + 3);
  }
}

TEST_CASE("surfaces that coincide divide no leaf") {
  FollowingTreeHost tree(build_kd_tree(cloud(64, 6, vec3(0)), kPerLeaf, 1), 64);
  std::vector<LeafSurvey> seen(tree.capacity(), LeafSurvey{vec3(0), 9, vec3(0), 0});
  for (LeafSurvey& s : seen) s = {vec3(0.5f), 9, vec3(0.5f), 100};
  seen[3] = {vec3(NAN), 9, vec3(0), 100};
  seen[4] = {vec3(INFINITY), 9, vec3(0), 100};
  CHECK(!tree.follow(seen, rules(9)));
  check(tree);
}

TEST_CASE("neighbours are the other leaves of the subtree, each as often") {
  std::vector<vec3> points = cloud(500, 7, vec3(0));
  FollowingTreeHost tree(build_kd_tree(points, kPerLeaf, 1), 400);
  std::vector<LeafSurvey> seen(tree.capacity(), LeafSurvey{});
  const std::vector<vec3> corner = cloud(3000, 8, vec3(1, 1, 0));  // an uneven tree
  for (uint number = 1; number < 12; ++number) {
    pass(tree, corner, number, seen);
    tree.follow(seen, rules(number));
  }
  const FollowingTree t = tree.header();
  const vec3 P = corner[17];
  const FollowingNode own = following_leaf(t, P);
  for (uint ascension : {0u, 1u, 3u, 5u, 1000u}) {
    CAPTURE(ascension);
    const FollowingNode subtree = following_above(t, P, ascension);
    const uint leaves = following_leaves(subtree);
    CHECK(own.first >= subtree.first);
    CHECK(own.first < subtree.first + leaves);
    if (ascension == 1000) CHECK(leaves == tree.leaves());
    std::map<uint, uint> drawn;
    const uint draws = 200 * leaves;
    for (uint i = 0; i < draws; ++i) {
      const uint slot = following_neighbour_of(t, subtree, own.first, 0, 1, (float(i) + 0.5f) / float(draws));
      if (ascension == 0) CHECK(slot == HW_NONE);
      ++drawn[slot];
    }
    if (ascension == 0) continue;
    CHECK(drawn.size() == leaves - 1);
    CHECK(drawn.count(own.link) == 0);
    for (const auto& [slot, count] : drawn) CHECK(std::abs(int(count) - int(draws / (leaves - 1))) <= 2);
  }
}

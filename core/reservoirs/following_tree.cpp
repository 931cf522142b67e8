// SPDX-License-Identifier: Apache-2.0
// Growing and pruning of the tree that follows its scene.
#include "reservoirs/following_tree.h"

#include <algorithm>
#include <cmath>

#include "lib/following_tree.h"
#include "lib/kd_tree.h"

namespace hw {

namespace {

FollowingNode leaf_node(std::uint32_t slot) { return {0.0f, slot, 0u, HW_FOLLOWING_LEAF}; }

// Where to divide two points, and along which axis: half-way along the one they lie furthest apart on, so that each
// has a side of its own. False: they coincide, or are not finite.
bool division(vec3 a, vec3 b, float& split, std::uint32_t& axis) {
  const vec3 d = abs(a - b);
  axis = d.x >= d.y && d.x >= d.z ? 0u : d.y >= d.z ? 1u : 2u;
  const float low = std::min(a[int(axis)], b[int(axis)]), high = std::max(a[int(axis)], b[int(axis)]);
  split = 0.5f * low + 0.5f * high;
  if (split <= low) split = high;
  return std::isfinite(split) && low < split && split <= high;
}

}  // namespace

FollowingTreeHost::FollowingTreeHost(const KdTreeNodes& built, std::uint32_t capacity)
    : capacity_(std::max(capacity, built.leaf_count)), leaf_of_(capacity_, HW_NONE), depth_of_(capacity_, 0) {
  // Node i of the heap has its children at 2 i + 1 and 2 i + 2, one behind the other as here.
  const std::uint32_t inner = built.leaf_count - 1;
  for (std::uint32_t i = 0; i < inner + built.leaf_count; ++i) {
    if (i < inner) {
      nodes_.push_back({kd_split(built.words[i]), 2 * i + 1, 0u, kd_axis(built.words[i])});
    } else {
      nodes_.push_back(leaf_node(i - inner));
      leaf_of_[i - inner] = i;
      depth_of_[i - inner] = built.depth;
    }
  }
  for (std::uint32_t slot = capacity_; slot-- > built.leaf_count;) free_slots_.push_back(slot);
  nodes_.reserve(2 * std::size_t(capacity_));
  rank();
}

FollowingTree FollowingTreeHost::header() const {
  return {reinterpret_cast<std::uint64_t>(nodes_.data()), reinterpret_cast<std::uint64_t>(order_.data())};
}

void FollowingTreeHost::rank() {
  order_.clear();
  struct Visit {
    std::uint32_t node, depth;
    bool below_done;
  };
  std::vector<Visit> stack{{0, 0, false}};
  while (!stack.empty()) {
    const Visit v = stack.back();
    stack.pop_back();
    FollowingNode& n = nodes_[v.node];
    if (following_is_leaf(n)) {
      n.first = std::uint32_t(order_.size());
      n.size = 1u << 2u | HW_FOLLOWING_LEAF;
      depth_of_[n.link] = v.depth;
      order_.push_back(n.link);
    } else if (v.below_done) {
      n.size = (std::uint32_t(order_.size()) - n.first) << 2u | (n.size & 3u);
    } else {
      n.first = std::uint32_t(order_.size());
      stack.push_back({v.node, v.depth, true});
      stack.push_back({n.link + 1, v.depth + 1, false});
      stack.push_back({n.link, v.depth + 1, false});
    }
  }
}

bool FollowingTreeHost::follow(std::span<const LeafSurvey> seen, const Rules& rules) {
  if (seen.size() < capacity_) return false;
  const bool pruned = prune(seen, rules);
  const bool divided = divide(seen, rules);
  if (pruned || divided) rank();
  return pruned || divided;
}

bool FollowingTreeHost::outgrown(std::span<const LeafSurvey> seen, const Rules& rules) {
  std::uint64_t all = 0, crowded = 0;
  for (const LeafSurvey& s : seen) {
    if (s.pass != rules.pass) continue;
    all += s.load;
    crowded += s.load > 8 * std::uint64_t(rules.crowded) ? s.load : 0;
  }
  return 2 * crowded > all;
}

// Children first, so that a place that is left goes at once, up to where something is still seen.
bool FollowingTreeHost::prune(std::span<const LeafSurvey> seen, const Rules& rules) {
  const auto stale = [&](const FollowingNode& n) { return rules.pass - seen[n.link].pass >= rules.stale_passes; };
  std::uint32_t gone = 0;
  std::vector<std::pair<std::uint32_t, bool>> stack{{0, false}};
  while (!stack.empty() && gone < rules.budget) {
    const auto [node, below_done] = stack.back();
    stack.pop_back();
    if (following_is_leaf(nodes_[node])) continue;
    const std::uint32_t below = nodes_[node].link;
    if (!below_done) {
      stack.push_back({node, true});
      stack.push_back({below + 1, false});
      stack.push_back({below, false});
      continue;
    }
    const FollowingNode a = nodes_[below], b = nodes_[below + 1];
    if (!following_is_leaf(a) || !following_is_leaf(b) || !stale(a) || !stale(b)) continue;
    leaf_of_[b.link] = HW_NONE;
    free_slots_.push_back(b.link);
    free_pairs_.push_back(below);
    nodes_[node] = leaf_node(a.link);
    leaf_of_[a.link] = node;
    ++gone;
  }
  return gone > 0;
}

bool FollowingTreeHost::divide(std::span<const LeafSurvey> seen, const Rules& rules) {
  std::vector<std::uint32_t> crowded;
  for (std::uint32_t slot = 0; slot < capacity_; ++slot) {
    const LeafSurvey& s = seen[slot];
    if (leaf_of_[slot] != HW_NONE && s.load > rules.crowded && rules.pass - s.pass < rules.stale_passes &&
        depth_of_[slot] < HW_FOLLOWING_MAX_DEPTH)
      crowded.push_back(slot);
  }
  std::stable_sort(crowded.begin(), crowded.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return seen[a].load > seen[b].load; });
  std::uint32_t come = 0;
  for (const std::uint32_t slot : crowded) {
    if (come >= rules.budget || free_slots_.empty()) break;
    float split;
    std::uint32_t axis;
    if (!division(seen[slot].position, seen[slot].witness, split, axis)) continue;
    std::uint32_t below;
    if (free_pairs_.empty()) {
      below = std::uint32_t(nodes_.size());
      nodes_.resize(nodes_.size() + 2);
    } else {
      below = free_pairs_.back();
      free_pairs_.pop_back();
    }
    const std::uint32_t other = free_slots_.back();
    free_slots_.pop_back();
    const std::uint32_t node = leaf_of_[slot];
    // The slot goes with the surface of its record.
    const bool above = seen[slot].position[int(axis)] >= split;
    nodes_[below] = leaf_node(above ? other : slot);
    nodes_[below + 1] = leaf_node(above ? slot : other);
    leaf_of_[slot] = above ? below + 1 : below;
    leaf_of_[other] = above ? below : below + 1;
    nodes_[node] = {split, below, 0u, axis};
    ++come;
  }
  return come > 0;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Two passes, each with subtrees on threads of their own: splits from the root down, bounds from the leaves up. A
// subtree's place in the array follows from how many lights it has, so that threads need not agree on anything.
//
// Departures from Conty Estevez and Kulla 2018: the cone of a bin is estimated by the mean of its axes, which costs a
// sum instead of a union (nodes have the exact one); boxes without area count by their diagonal.
#include "lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "lib/frame.h"
#include "lib/light_tree.h"
#include "lib/packed_float.h"
#include "lights/light_bounds.h"
#include "threads/parts.h"

namespace hw {
namespace {

constexpr std::size_t kLightsPerThread = 1 << 13;  // below this a thread costs more than it saves
constexpr int kBins = 12;
constexpr int kDeepest = 48;  // splits in the middle from here on, so that no input makes a chain
constexpr double kLoosest = 1.5;

struct Item {
  LightBounds bounds;
  std::uint32_t light;
  vec3 middle() const { return (bounds.low + bounds.high) * 0.5f; }
};

// Of `threads`, those that are worth their start for so many lights.
int worth(int threads, std::size_t lights) { return lights < kLightsPerThread ? 1 : threads; }

// A measure of directions light leaves in: Conty Estevez and Kulla 2018, equation 1.
float cone_measure(float theta_o, float theta_e) {
  const float theta_w = std::min(theta_o + theta_e, HW_PI);
  const float sine = std::sin(theta_o), cosine = std::cos(theta_o);
  return 2 * HW_PI * (1 - cosine) +
         0.5f * HW_PI * (2 * theta_w * sine - std::cos(theta_o - 2 * theta_w) - 2 * theta_o * sine + cosine);
}

float box_measure(vec3 low, vec3 high) {
  const vec3 e = high - low;
  return 2 * (e.x * e.y + e.y * e.z + e.z * e.x) + 0.01f * glm::dot(e, e);
}

// What a bin, or several, holds. Arrays of four that compilers make one operation of.
struct Bin {
  alignas(16) std::array<float, 4> least{HW_INFINITY, HW_INFINITY, HW_INFINITY, 0};  // box; -theta_o
  std::array<float, 4> most{-HW_INFINITY, -HW_INFINITY, -HW_INFINITY, 0};            // box; theta_e
  std::array<float, 4> sum{};                                                        // unit axes; power
  std::uint32_t count = 0;

  void add(const Bin& b) {
    for (int i = 0; i < 4; ++i) least[i] = b.least[i] < least[i] ? b.least[i] : least[i];
    for (int i = 0; i < 4; ++i) most[i] = b.most[i] > most[i] ? b.most[i] : most[i];
    for (int i = 0; i < 4; ++i) sum[i] += b.sum[i];
    count += b.count;
  }
  float cost() const {
    const float theta_o = -least[3], theta_e = most[3];
    float cone = 4 * HW_PI;
    if (theta_o < HW_PI) {
      // Axes spread evenly over a cap of half angle a have a mean of length (1 + cos a) / 2.
      const float mean = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / static_cast<float>(count);
      const float spread = std::acos(std::clamp(2 * mean - 1, -1.0f, 1.0f));
      cone = cone_measure(std::min(theta_o + spread, HW_PI), theta_e);
    }
    return sum[3] * box_measure(vec3(least[0], least[1], least[2]), vec3(most[0], most[1], most[2])) * (0.1f + cone);
  }
};

class Builder {
 public:
  Builder(std::vector<Item>& items, std::vector<LightTreeNode>& nodes) : items_(items), nodes_(nodes) {}

  // Splits items [first, first + count) below `node`; nodes from `free` on are theirs, 2 count - 2 of them.
  void build(std::uint32_t node, std::size_t first, std::size_t count, std::uint32_t free, int depth, int threads) {
    LightTreeNode& n = nodes_[node];
    n.child = count > 1 ? free : HW_NONE;
    n.middle = static_cast<std::uint32_t>(first);
    if (count == 1) return;
    const std::size_t left = split(first, count, depth);
    n.middle += static_cast<std::uint32_t>(left);
    if (count <= HW_LIGHT_TREE_FEW) {
      n.child |= static_cast<std::uint32_t>(count - 1) << HW_LIGHT_TREE_LINK_BITS;
      n.middle |= static_cast<std::uint32_t>(left) << HW_LIGHT_TREE_LINK_BITS;
    }
    const auto right_free = static_cast<std::uint32_t>(free + 2 * left);
    both(
        worth(threads, count), [&, this](int t) { build(free, first, left, free + 2, depth + 1, t); },
        [&, this](int t) { build(free + 1, first + left, count - left, right_free, depth + 1, t); });
  }

 private:
  // Orders the items and returns how many go left: neither none nor all.
  std::size_t split(std::size_t first, std::size_t count, int depth) {
    const auto begin = items_.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(count);
    if (depth == 0) {
      const auto local = std::stable_partition(begin, end, [](const Item& i) { return !i.bounds.distant; });
      if (local != begin && local != end) return static_cast<std::size_t>(local - begin);
    }
    if (count == 2) return 1;
    vec3 low(HW_INFINITY), high(-HW_INFINITY);
    for (auto i = begin; i != end; ++i) {
      low = glm::min(low, i->middle());
      high = glm::max(high, i->middle());
    }
    const vec3 extent = high - low;
    const float widest = std::max({extent.x, extent.y, extent.z});
    if (!(widest > 0)) return count / 2;
    if (depth < kDeepest) {
      const auto found = best_split(begin, end, low, extent, widest);
      if (found.axis >= 0) {
        const auto middle = std::partition(begin, end, [&](const Item& i) {
          return bin_of(i.middle()[found.axis], low[found.axis], found.scale) <= found.last;
        });
        if (middle != begin && middle != end) return static_cast<std::size_t>(middle - begin);
      }
    }
    const int axis = extent.x == widest ? 0 : extent.y == widest ? 1 : 2;
    const auto half = begin + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(begin, half, end, [axis](const Item& a, const Item& b) {
      const float x = a.middle()[axis], y = b.middle()[axis];
      return x < y || (x == y && a.light < b.light);
    });
    return count / 2;
  }

  static int bin_of(float at, float low, float scale) {
    return std::min(static_cast<int>((at - low) * scale), kBins - 1);
  }

  struct Split {
    int axis = -1;  // none: no split is worth anything
    int last = 0;   // bins 0 .. last go left
    float scale = 0;
  };

  template <class Iterator>
  static Split best_split(Iterator begin, Iterator end, vec3 low, vec3 extent, float widest) {
    std::array<std::array<Bin, kBins>, 3> bins;
    vec3 scale(0);
    for (int axis = 0; axis < 3; ++axis)
      if (extent[axis] > 1e-6f * widest) scale[axis] = static_cast<float>(kBins) / extent[axis];
    const vec3 reference = begin->bounds.axis;
    for (auto i = begin; i != end; ++i) {
      const LightBounds& b = i->bounds;
      const float side = b.two_sided && glm::dot(b.axis, reference) < 0 ? -1.0f : 1.0f;
      const Bin one{{b.low.x, b.low.y, b.low.z, -b.theta_o},
                    {b.high.x, b.high.y, b.high.z, b.theta_e},
                    {side * b.axis.x, side * b.axis.y, side * b.axis.z, b.power},
                    1};
      const vec3 middle = i->middle();
      for (int axis = 0; axis < 3; ++axis)
        if (scale[axis] > 0) bins[axis][bin_of(middle[axis], low[axis], scale[axis])].add(one);
    }
    Split best;
    float least = HW_INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(scale[axis] > 0) || !std::isfinite(scale[axis])) continue;
      std::array<float, kBins> right{};
      Bin sum;
      for (int k = kBins - 1; k > 0; --k) {
        if (bins[axis][k].count == 0) {
          right[k] = k + 1 < kBins ? right[k + 1] : 0.0f;
          continue;
        }
        sum.add(bins[axis][k]);
        right[k] = sum.cost();
      }
      const std::uint32_t all = sum.count + bins[axis][0].count;
      sum = Bin{};
      const float longer = widest / extent[axis];  // cuts across the long way are favoured
      for (int k = 0; k + 1 < kBins; ++k) {
        if (bins[axis][k].count == 0) continue;
        sum.add(bins[axis][k]);
        if (sum.count == all) break;
        const float cost = (sum.cost() + right[k + 1]) * longer;
        if (cost < least) {
          least = cost;
          best = {axis, k, scale[axis]};
        }
      }
    }
    return best;
  }

  std::vector<Item>& items_;
  std::vector<LightTreeNode>& nodes_;
};

// What places are counted in: the box about the lights; of lights far outside of where the middle half of them is (256
// times its size), spheres reach to the lights from the box's side.
LightTreeScale scale_of(std::span<const Item> items) {
  LightTreeScale scale{vec3(0), vec3(1)};
  for (int axis = 0; axis < 3; ++axis) {
    float low = HW_INFINITY, high = -HW_INFINITY;
    for (const Item& i : items) {
      if (i.bounds.distant) continue;
      low = std::min(low, i.bounds.low[axis]);
      high = std::max(high, i.bounds.high[axis]);
    }
    if (!(low <= high)) return scale;
    std::vector<float> some;
    const std::size_t every = items.size() / 4096 + 1;
    for (std::size_t i = 0; i < items.size(); i += every)
      if (!items[i].bounds.distant) some.push_back(items[i].middle()[axis]);
    if (some.size() >= 4) {
      std::sort(some.begin(), some.end());
      const float first = some[some.size() / 4], last = some[some.size() * 3 / 4];
      const float reach = 256 * (last - first);
      if (reach > 0) {
        low = std::max(low, first - reach);
        high = std::min(high, last + reach);
      }
    }
    scale.corner[axis] = low;
    scale.step[axis] = std::max((high - low) / HW_LIGHT_TREE_PLACES, 1e-20f);
  }
  return scale;
}

// sin(theta / 2) * 255, rounded up.
std::uint32_t half_sine(float theta) {
  return static_cast<std::uint32_t>(std::min(std::ceil(255 * std::sin(0.5f * std::min(theta, HW_PI))), 255.0f));
}

LightTreeBounds pack(const LightBounds& b, const LightTreeScale& scale) {
  const vec3 middle = b.distant ? b.axis : b.low + (b.high - b.low) * 0.5f;
  const vec3 steps =
      b.distant ? (b.axis + vec3(1)) * (0.5f * HW_LIGHT_TREE_PLACES) : (middle - scale.corner) / scale.step;
  std::uint32_t at[3];
  for (int axis = 0; axis < 3; ++axis)
    at[axis] = static_cast<std::uint32_t>(std::clamp(std::round(steps[axis]), 0.0f, HW_LIGHT_TREE_PLACES));
  const vec2 axis = glm::round((unpackSnorm2x16(octahedral_pack(b.axis)) + vec2(1)) * 127.5f);

  LightTreeBounds n;
  n.place_low = at[0] | at[1] << 21u;
  n.place_high = at[1] >> 11u | at[2] << 10u | (b.two_sided ? HW_LIGHT_TREE_TWO_SIDED : 0u);
  n.strength = b.distant ? HW_LIGHT_TREE_DISTANT : 0u;
  n = light_tree_with_power(n, b.power);
  n.cone = static_cast<std::uint32_t>(axis.x) | static_cast<std::uint32_t>(axis.y) << 8u;
  // Rounding moved the middle and turned the axis: bounds grow by as much.
  const vec3 now = light_tree_middle(n, scale);
  const auto angle = [](vec3 a, vec3 c) { return std::acos(std::clamp(glm::dot(a, glm::normalize(c)), -1.0f, 1.0f)); };
  const float turned = b.distant ? angle(b.axis, now) : angle(b.axis, light_tree_axis(n));
  const float radius = b.distant ? 0 : 0.5f * glm::length(b.high - b.low) + 1.0001f * glm::distance(middle, now);
  n.strength |= upper_float_above(radius) << 16u;
  n.cone |= half_sine(b.theta_o + turned) << 16u | half_sine(b.theta_e) << 24u;
  return n;
}

// Brings powers into range by one factor; nothing that emits may become unreachable beside something very strong.
// Returns the unit.
float scale_powers(std::span<Item> items, float scene_radius) {
  // By the mean intensity; without lights that have a place, by the mean irradiance over the scene's size.
  double local = 0, distant = 0;
  std::size_t locals = 0;
  for (const Item& i : items) {
    (i.bounds.distant ? distant : local) += i.bounds.power;
    locals += !i.bounds.distant;
  }
  const double r2 = std::clamp(double{scene_radius} * scene_radius, 1e-30, 1e30);
  const double mean = locals > 0 ? local / double(locals) : distant * r2 / double(items.size());
  const double least_distant = std::clamp(1e-5 / r2, 1e-20, 1e20);
  for (Item& i : items)
    i.bounds.power = static_cast<float>(
        std::clamp(i.bounds.power / std::max(mean, 1e-300), i.bounds.distant ? least_distant : 1e-5, 1e20));
  return static_cast<float>(std::clamp(mean, 1e-30, 1e30));
}

// Bounds of `items`, whose lights are given. Returns the unit of their power.
float measure(std::span<Item> items, const LightTreeInput& input, int threads) {
  in_parts(threads, kLightsPerThread, 0, items.size(), [&](std::size_t begin, std::size_t end) {
    for (Item& i : items.subspan(begin, end - begin))
      i.bounds = light_bounds(input.lights[i.light], input.weights[i.light], input.scene_radius);
  });
  return scale_powers(items, input.scene_radius);
}

// Bounds of a subtree, and power by area of its inner nodes.
struct Summary {
  LightBounds bounds;
  double looseness = 0;
  double top = 0;  // the same of the highest nodes whose lights have a place
  double measure() const { return bounds.distant ? 0 : double{bounds.power} * box_measure(bounds.low, bounds.high); }
};

// Writes bounds to `node`, over items [first, first + count), and what is below. `items`: in leaf order.
Summary fit(LightTree& tree, std::span<const Item> items, std::uint32_t node, std::uint32_t first, std::uint32_t count,
            int threads) {
  LightTreeNode& n = tree.nodes[node];
  const uvec2 links = light_tree_unpack_links({n.child, n.middle});
  Summary sum;
  if (links.x == HW_NONE) {
    sum.bounds = items[first].bounds;
    tree.leaves[first] = pack(sum.bounds, tree.scale);
  } else {
    Summary a, b;
    const std::uint32_t left = links.y - first;
    both(
        worth(threads, count), [&](int t) { a = fit(tree, items, links.x, first, left, t); },
        [&](int t) { b = fit(tree, items, links.x + 1, links.y, count - left, t); });
    sum.bounds = unite(a.bounds, b.bounds);
    sum.looseness = a.looseness + b.looseness;
    if (a.bounds.distant == b.bounds.distant)
      sum.looseness += double{sum.bounds.power} * box_measure(sum.bounds.low, sum.bounds.high);
    // What is next to a root over lights at infinity and others, or the root itself: the box of those with a place.
    sum.top = a.bounds.distant == b.bounds.distant ? sum.measure() : std::max(a.measure(), b.measure());
  }
  n.bounds = links.x == HW_NONE ? tree.leaves[first] : pack(sum.bounds, tree.scale);
  return sum;
}

double fit_all(LightTree& tree, std::span<const Item> items, int threads) {
  tree.scale = scale_of(items);
  tree.leaves.resize(items.size());
  const Summary all = fit(tree, items, 0, 0, static_cast<std::uint32_t>(items.size()), threads);
  // In units of the box about all that has a place, so that a scene may grow.
  return all.top > 0 ? all.looseness / all.top : 0;
}

}  // namespace

LightTree build_light_tree(const LightTreeInput& input) {
  LightTree tree;
  tree.position.assign(input.lights.size(), HW_NONE);
  if (input.lights.size() >= std::size_t{1} << (HW_LIGHT_TREE_LINK_BITS - 1))
    throw std::length_error("a light tree holds 2^28 - 1 lights");
  const int threads = thread_count(input.threads);
  std::vector<Item> items;
  items.reserve(input.lights.size());
  for (std::size_t i = 0; i < input.lights.size(); ++i)
    if (input.weights[i] > 0) items.push_back({{}, static_cast<std::uint32_t>(i)});
  if (items.empty()) return tree;
  tree.unit = measure(items, input, threads);
  tree.nodes.resize(2 * items.size() - 1);
  Builder(items, tree.nodes).build(0, 0, items.size(), 1, 0, threads);
  tree.order.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    tree.order[i] = items[i].light;
    tree.position[items[i].light] = static_cast<std::uint32_t>(i);
  }
  tree.looseness = tree.built_looseness = fit_all(tree, items, threads);
  return tree;
}

bool refit_light_tree(LightTree& tree, const LightTreeInput& input) {
  if (tree.position.size() != input.lights.size()) return false;
  for (std::size_t i = 0; i < input.lights.size(); ++i)
    if ((input.weights[i] > 0) != (tree.position[i] != HW_NONE)) return false;
  if (tree.nodes.empty()) return true;
  const int threads = thread_count(input.threads);
  std::vector<Item> items;
  items.reserve(tree.order.size());
  for (const std::uint32_t light : tree.order) items.push_back({{}, light});
  tree.unit = measure(items, input, threads);
  tree.looseness = fit_all(tree, items, threads);
  return tree.looseness <= kLoosest * tree.built_looseness;
}

}  // namespace hw

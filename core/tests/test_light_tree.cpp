// SPDX-License-Identifier: Apache-2.0
// The light tree: every light is found with the chance that is told, bounds exclude no light, builds are the same for
// any number of threads, refits bound what moved.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include "lib/light_tree.h"
#include "light_cases.h"
#include "lights/light_bounds.h"
#include "lights/light_tree.h"

using namespace hw;
using namespace hw::light_test;

namespace {

struct Lights {
  std::vector<LightRecord> records;
  std::vector<float> weights;

  void add(const LightRecord& record, float weight) {
    records.push_back(record);
    weights.push_back(weight);
  }
  LightTreeInput input(int threads = 2) const { return {records, weights, 10, threads}; }
};

LightTreeTables tables(const LightTree& t) {
  return {reinterpret_cast<std::uint64_t>(t.nodes.data()), reinterpret_cast<std::uint64_t>(t.leaves.data()),
          reinterpret_cast<std::uint64_t>(t.order.data()), reinterpret_cast<std::uint64_t>(t.position.data()), t.scale};
}

LightRecord world() {
  LightRecord r{};
  r.type = HW_LIGHT_WORLD;
  r.emission = vec3(1);
  r.axis_z = vec3(0, 0, 1);
  return r;
}

LightRecord point(vec3 at, float radius = 0) {
  LightRecord r{};
  r.type = HW_LIGHT_POINT;
  r.position = at;
  r.emission = vec3(1);
  r.size_x = radius;
  return r;
}

// Lights of every kind, moved to places in a box of `size`; each tenth has no weight.
Lights mixed(std::size_t rounds, std::uint32_t seed, float size = 20) {
  Lights lights;
  Random random(seed);
  lights.add(world(), 50);
  for (std::size_t i = 0; i < rounds; ++i)
    for (LightCase& c : light_cases(seed + static_cast<std::uint32_t>(i))) {
      c.light.position += vec3(random(0, size), random(0, size), random(0, 3));
      lights.add(c.light, lights.records.size() % 10 == 9 ? 0 : std::exp(random(-4, 4)));
    }
  return lights;
}

// Some places in the scene, some near a light, with normals every way.
LightTreeReceiver receiver(const Lights& lights, Random& random, int how) {
  LightTreeReceiver r;
  r.position = vec3(random(-2, 22), random(-2, 22), random(-1, 4));
  const LightRecord& l = lights.records[static_cast<std::size_t>(random(0, float(lights.records.size())))];
  if (how % 3 == 1 && l.type != HW_LIGHT_SUN && l.type != HW_LIGHT_WORLD)
    r.position = light_test::receiver({"", l, 1}, how, random);
  r.normal = random.direction();
  r.transmits = how % 5 == 4;
  return r;
}

// Lights below a node: the place of the first and how many.
// Left child, HW_NONE of a leaf, and first position of the right one.
uvec2 links_of(const LightTree& t, std::size_t node) {
  return light_tree_links(tables(t).nodes, static_cast<uint>(node));
}

struct Range {
  std::uint32_t first, count;
};
std::vector<Range> ranges(const LightTree& t) {
  std::vector<Range> r(t.nodes.size());
  if (!r.empty()) r[0] = {0, static_cast<std::uint32_t>(t.order.size())};
  for (std::size_t i = 0; i < t.nodes.size(); ++i) {
    const uvec2 links = links_of(t, i);
    if (links.x == HW_NONE) continue;
    r[links.x] = {r[i].first, links.y - r[i].first};
    r[links.x + 1] = {links.y, r[i].first + r[i].count - links.y};
  }
  return r;
}

// Every light of weight once, ranges that follow from one another, spheres around what is below and cones about it.
void check_structure(const Lights& lights, const LightTree& t) {
  const auto reachable = std::count_if(lights.weights.begin(), lights.weights.end(), [](float w) { return w > 0; });
  REQUIRE(t.order.size() == static_cast<std::size_t>(reachable));
  REQUIRE(t.nodes.size() == (reachable ? 2 * t.order.size() - 1 : 0));
  REQUIRE(t.position.size() == lights.records.size());
  for (std::size_t i = 0; i < lights.records.size(); ++i) {
    REQUIRE((t.position[i] != HW_NONE) == (lights.weights[i] > 0));
    if (t.position[i] != HW_NONE) REQUIRE(t.order[t.position[i]] == i);
  }
  const std::vector<Range> range = ranges(t);
  bool nested = true, inside = true;
  for (std::size_t i = 0; i < t.nodes.size(); ++i) {
    const LightTreeNode& n = t.nodes[i];
    const float power = light_tree_power(n.bounds);
    nested &= power > 0 && std::isfinite(power);
    const uvec2 links = links_of(t, i);
    nested &= links.x == HW_NONE ? range[i].count == 1 && links.y == range[i].first
                                 : links.x > i && range[links.x].count > 0 && range[links.x + 1].count > 0;
    // Few lights are told by their node alone, and their leaves are those of the tree.
    const uvec2 packed(n.child, n.middle);
    nested &= range[i].count <= HW_LIGHT_TREE_FEW
                  ? light_tree_few(packed) == range[i].count && light_tree_few_first(packed) == range[i].first
                  : packed == links;
    if (links.x == HW_NONE) nested &= std::memcmp(&n.bounds, &t.leaves[links.y], sizeof n.bounds) == 0;
    if (range[i].count > 3000) continue;  // the work is that of all levels
    const vec3 middle = light_tree_middle(n.bounds, t.scale), axis = light_tree_axis(n.bounds);
    const double radius = light_tree_radius(n.bounds);
    const float theta_o = 2 * std::asin(float(n.bounds.cone >> 16 & 255) / 255);
    for (std::uint32_t place = range[i].first; place < range[i].first + range[i].count; ++place) {
      const std::uint32_t light = t.order[place];
      const LightBounds b = light_bounds(lights.records[light], lights.weights[light], 10);
      if ((n.bounds.strength & HW_LIGHT_TREE_DISTANT) != 0) {
        inside &=
            b.distant && std::acos(glm::clamp(dot(glm::normalize(middle), b.axis), -1.0f, 1.0f)) <= theta_o + 2e-3f;
        continue;
      }
      const float off = std::acos(glm::clamp(dot(axis, b.axis), -1.0f, 1.0f));
      const bool other_way = (n.bounds.place_high & HW_LIGHT_TREE_TWO_SIDED) != 0;
      inside &= b.distant || (other_way ? std::min(off, HW_PI - off) : off) <= theta_o + 2e-3f;
      if (b.distant) continue;
      for (const vec3 corner : {b.low, b.high, vec3(b.low.x, b.high.y, b.low.z)})
        inside &=
            glm::distance(glm::dvec3(corner), glm::dvec3(middle)) <= radius * (1 + 1e-5) + 1e-5 * glm::length(middle);
    }
  }
  CHECK(nested);
  CHECK(inside);
}

double sum_of_chances(const Lights& lights, const LightTree& t, const LightTreeReceiver& r) {
  double sum = 0;
  for (std::uint32_t i = 0; i < lights.records.size(); ++i) sum += light_tree_chance(tables(t), 0, i, r);
  return sum;
}

bool same(const LightTree& a, const LightTree& b) {
  return a.order == b.order && a.position == b.position && a.nodes.size() == b.nodes.size() &&
         std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(LightTreeNode)) == 0;
}

}  // namespace

TEST_CASE("the light tree draws each light with the chance it tells") {
  const Lights lights = mixed(3, 5);
  const LightTree t = build_light_tree(lights.input());
  check_structure(lights, t);
  Random random(11);
  for (int how = 0; how < 12; ++how) {
    const LightTreeReceiver r = receiver(lights, random, how);
    constexpr int kDraws = 40000;
    std::vector<double> drawn(lights.records.size(), 0);
    double none = 0, last = 0;
    for (int i = 0; i < kDraws; ++i) {
      float u = (float(i) + random()) / kDraws, pdf;
      u = std::min(u, 0.99999994f);
      const uint light = light_tree_draw(tables(t), 0, r, u, pdf);
      REQUIRE(u >= 0);
      REQUIRE(u < 1);
      last += u;
      if (light == HW_NONE) {
        REQUIRE(pdf == 0);
        none += 1;
        continue;
      }
      drawn[light] += 1;
      REQUIRE(pdf > 0);
      REQUIRE(light_tree_chance(tables(t), 0, light, r) == pdf);
    }
    double chi2 = 0, sum = 0;
    int cells = 0;
    for (std::uint32_t i = 0; i < lights.records.size(); ++i) {
      const double expected = kDraws * double(light_tree_chance(tables(t), 0, i, r));
      sum += expected;
      if (expected == 0) CHECK(drawn[i] == 0);
      if (expected < 5) continue;
      chi2 += (drawn[i] - expected) * (drawn[i] - expected) / expected;
      ++cells;
    }
    CHECK(sum + none == doctest::Approx(kDraws).epsilon(0.01));
    // The draws are stratified: far better than independent ones, for which chi2 is about `cells`.
    CHECK(chi2 < cells + 5 * std::sqrt(2.0 * cells));
    if (none == 0) {
      CHECK(sum == doctest::Approx(kDraws).epsilon(1e-4));
      CHECK(last / kDraws == doctest::Approx(0.5).epsilon(0.05));
    }
  }
}

TEST_CASE("chances below an inner node of the light tree are those given the node") {
  const Lights lights = mixed(2, 8);
  const LightTree t = build_light_tree(lights.input());
  const std::vector<Range> below = ranges(t);
  Random random(3);
  for (int how = 0; how < 200; ++how) {
    const LightTreeReceiver r = receiver(lights, random, how);
    const auto node = static_cast<std::uint32_t>(random(0, float(t.nodes.size())));
    float u = random(), pdf;
    const uint light = light_tree_draw(tables(t), node, r, u, pdf);
    if (light == HW_NONE) continue;
    CHECK(t.position[light] >= below[node].first);
    CHECK(t.position[light] < below[node].first + below[node].count);
    CHECK(light_tree_chance(tables(t), node, light, r) == pdf);
  }
}

TEST_CASE("no light that can contribute is out of the light tree's reach") {
  Random random(21);
  int found = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const Lights lights = mixed(1, 100 + seed, 6);
    const LightTree t = build_light_tree(lights.input());
    for (int how = 0; how < 60; ++how) {
      const LightTreeReceiver r = receiver(lights, random, how);
      for (std::uint32_t i = 0; i < lights.records.size(); ++i) {
        if (!(lights.weights[i] > 0) || lights.records[i].type == HW_LIGHT_WORLD) continue;
        bool contributes = false;
        for (int k = 0; k < 8 && !contributes; ++k) {
          LightSample s;
          contributes = light_sample(lights.records[i], 0, r.position, vec3(random(), random(), 0), s) && s.pdf > 0 &&
                        (r.transmits || dot(r.normal, s.wi) > 1e-4f);
        }
        found += contributes;
        if (contributes) {
          CAPTURE(i % 21);
          CHECK(light_tree_chance(tables(t), 0, i, r) > 0);
        }
      }
      if (r.transmits) CHECK(light_tree_chance(tables(t), 0, 0, r) > 0);  // the world
    }
  }
  CHECK(found > 3000);
}

TEST_CASE("nearer, stronger and better placed lights have the greater chance") {
  Lights lights;
  lights.add(point(vec3(0, 0, 1)), 1);
  lights.add(point(vec3(5, 0, 1)), 1);
  lights.add(point(vec3(-5, 0, 1)), 4);
  lights.add(point(vec3(0, 0, -1)), 100);
  const LightTree t = build_light_tree(lights.input());
  const LightTreeReceiver up{vec3(0), vec3(0, 0, 1), false};
  const auto chance = [&](uint i) { return light_tree_chance(tables(t), 0, i, up); };
  CHECK(chance(0) > 0.6f);
  CHECK(chance(2) > 1.5f * chance(1));
  CHECK(chance(3) == 0);
  CHECK(light_tree_chance(tables(t), 0, 3, {vec3(0), vec3(0, 0, 1), true}) > 0.7f);
}

TEST_CASE("few lights are chosen each by its own importance, however far they are spread") {
  // A ring of lamps about all that they light: of boxes over several of them nothing could be told.
  for (int count = 2; count <= int(HW_LIGHT_TREE_FEW); ++count) {
    Lights lights;
    for (int i = 0; i < count; ++i) {
      const float turn = 2 * HW_PI * float(i) / float(count);
      lights.add(point(vec3(10 * std::cos(turn), 10 * std::sin(turn), 5)), 1);
    }
    const LightTree t = build_light_tree(lights.input());
    const vec3 at(6, 1, 0);
    const LightTreeReceiver r{at, vec3(0, 0, 1), false};
    std::vector<double> irradiance;
    double sum = 0, roots = 0;
    for (const LightRecord& light : lights.records) {
      const vec3 to = light.position - at;
      const double d2 = glm::dot(to, to);
      irradiance.push_back(to.z / (d2 * std::sqrt(d2)));
      sum += irradiance.back();
      roots += std::sqrt(irradiance.back());
    }
    for (int i = 0; i < count; ++i) {
      const double expected =
          (irradiance[i] / sum + HW_LIGHT_TREE_EVEN * std::sqrt(irradiance[i]) / roots) / (1 + HW_LIGHT_TREE_EVEN);
      CHECK(light_tree_chance(tables(t), 0, i, r) == doctest::Approx(expected).epsilon(0.03));
    }
  }
}

TEST_CASE("light trees are the same for any number of threads") {
  Lights lights;
  Random random(4);
  for (int i = 0; i < 60000; ++i) {
    const vec3 a = vec3(random(0, 100), random(0, 100), random(0, 10));
    lights.add(triangle(a, a + random.direction() * 0.1f, a + random.direction() * 0.1f, vec3(1), i % 2 == 0),
               random(0, 2));
  }
  const LightTree once = build_light_tree(lights.input(1));
  check_structure(lights, once);
  for (const int threads : {2, 3, 7, 0}) CHECK(same(once, build_light_tree(lights.input(threads))));
}

TEST_CASE("a refit light tree bounds what moved, as a new one does") {
  Lights lights = mixed(4, 17);
  LightTree t = build_light_tree(lights.input());
  const LightTree before = t;
  REQUIRE(refit_light_tree(t, lights.input(1)));
  CHECK(same(before, t));

  Random random(2);
  for (LightRecord& l : lights.records) l.position += random.direction() * 0.3f;
  for (float& w : lights.weights) w *= random(0.5f, 2);
  REQUIRE(refit_light_tree(t, lights.input()));
  check_structure(lights, t);
  CHECK(t.order == before.order);
  const LightTree fresh = build_light_tree(lights.input());
  // The subtree of lights that have a place: the same sphere and power, whatever its inner nodes.
  const auto local = [](const LightTree& tree) { return tree.nodes[links_of(tree, 0).x].bounds; };
  CHECK(light_tree_middle(local(t), t.scale) == light_tree_middle(local(fresh), fresh.scale));
  CHECK(light_tree_radius(local(t)) == light_tree_radius(local(fresh)));
  CHECK(light_tree_power(local(t)) == doctest::Approx(light_tree_power(local(fresh))).epsilon(0.01));
  for (int how = 0; how < 30; ++how)
    CHECK(sum_of_chances(lights, t, receiver(lights, random, how)) <= doctest::Approx(1).epsilon(1e-4));

  // Another set of lights, or places all over one another: to be built anew.
  LightTree stale = before;
  std::vector<float> weights = lights.weights;
  weights[0] = 0;
  CHECK_FALSE(refit_light_tree(stale, {lights.records, weights, 10, 1}));
  stale = before;
  Lights shuffled = lights;
  for (LightRecord& l : shuffled.records) l.position = vec3(random(0, 20), random(0, 20), random(0, 3));
  CHECK_FALSE(refit_light_tree(stale, shuffled.input()));
  stale = before;
  shuffled.add(point(vec3(0)), 1);
  CHECK_FALSE(refit_light_tree(stale, shuffled.input()));
}

TEST_CASE("light trees of odd inputs") {
  Random random(9);
  const LightTreeReceiver r{vec3(0), vec3(0, 0, 1), true};
  float u = 0.5f, pdf;
  SUBCASE("none") {
    Lights lights;
    CHECK(build_light_tree(lights.input()).nodes.empty());
    lights.add(point(vec3(1)), 0);
    lights.add(point(vec3(1)), std::numeric_limits<float>::quiet_NaN());
    const LightTree t = build_light_tree(lights.input());
    check_structure(lights, t);
    CHECK(t.nodes.empty());
    CHECK(t.position[0] == HW_NONE);
  }
  SUBCASE("one") {
    for (const LightRecord& l : {point(vec3(0, 0, 1)), world()}) {
      Lights lights;
      lights.add(l, 3);
      const LightTree t = build_light_tree(lights.input());
      check_structure(lights, t);
      CHECK(light_tree_draw(tables(t), 0, r, u, pdf) == 0);
      CHECK(pdf == 1);
      CHECK(light_tree_chance(tables(t), 0, 0, r) == 1);
    }
  }
  SUBCASE("all at one point") {
    Lights lights;
    for (int i = 0; i < 1 << 17; ++i) lights.add(point(vec3(0, 0, 1)), 1);
    const LightTree t = build_light_tree(lights.input());
    check_structure(lights, t);
    std::vector<int> drawn(8, 0);
    std::set<float> left;  // of the random numbers: after 17 halvings there are 7 of their own bits
    for (int i = 0; i < 100000; ++i) {
      u = random();
      const uint light = light_tree_draw(tables(t), 0, {random.direction(), vec3(0, 0, 1), true}, u, pdf);
      REQUIRE(light != HW_NONE);
      CHECK(pdf == doctest::Approx(0x1p-17));
      ++drawn[t.position[light] % 8];
      left.insert(u);
    }
    CHECK(left.size() > 50000);
    for (const int d : drawn) CHECK(std::abs(d - 12500) < 500);
    // At the lights themselves, and where one cannot tell their direction.
    CHECK(light_tree_draw(tables(t), 0, {vec3(0, 0, 1), vec3(0, 0, 1), false}, u, pdf) != HW_NONE);
  }
  SUBCASE("in a plane, on a line, at distances of a geometric row") {
    for (int shape = 0; shape < 3; ++shape) {
      Lights lights;
      for (int i = 0; i < 3000; ++i)
        lights.add(point(shape == 0   ? vec3(random(), random(), 2)
                         : shape == 1 ? vec3(0, random(), 0)
                                      : vec3(std::exp2(float(i % 100) - 50), 0, 0)),
                   1);
      const LightTree t = build_light_tree(lights.input());
      check_structure(lights, t);
      std::vector<int> depth(t.nodes.size(), 0);
      for (std::size_t i = 0; i < t.nodes.size(); ++i)
        if (const uvec2 links = links_of(t, i); links.x != HW_NONE) depth[links.x] = depth[links.x + 1] = depth[i] + 1;
      CHECK(*std::max_element(depth.begin(), depth.end()) < 80);
      CHECK(sum_of_chances(lights, t, r) == doctest::Approx(1).epsilon(1e-3));
    }
  }
  SUBCASE("powers and places at the ends of what floats hold") {
    Lights lights;
    LightRecord sun{};
    sun.type = HW_LIGHT_SUN;
    sun.axis_z = vec3(0, 0, 1);
    lights.add(point(vec3(0, 0, 1)), 1e-37f);
    lights.add(point(vec3(1, 0, 1)), 3e38f);
    lights.add(point(vec3(1e30f, 0, 1)), 1);
    lights.add(point(vec3(3e38f, -3e38f, 1)), 3e38f);
    lights.add(point(vec3(1e17f, 0, 1)), 1);
    lights.add(sun, 3e38f);
    lights.add(world(), 1e-30f);
    const LightTree t = build_light_tree(lights.input());
    check_structure(lights, t);
    for (const vec3 P : {vec3(0), vec3(0, 0, 1), vec3(1e17f, 0, 0), vec3(1e30f, 0, 0)}) {
      const LightTreeReceiver at{P, vec3(0, 0, 1), true};
      for (uint i = 0; i < lights.records.size(); ++i) CHECK(light_tree_chance(tables(t), 0, i, at) > 0);
      CHECK(sum_of_chances(lights, t, at) == doctest::Approx(1).epsilon(1e-3));
      u = random();
      CHECK(light_tree_draw(tables(t), 0, at, u, pdf) != HW_NONE);
    }
  }
}

TEST_CASE("a million lights: time to build and refit the light tree" * doctest::skip()) {
  Lights lights;
  Random random(4);
  for (int i = 0; i < 1000000; ++i) {
    const vec3 a = vec3(random(0, 1000), random(0, 1000), random(0, 30));
    lights.add(i % 2 ? triangle(a, a + random.direction() * 0.1f, a + random.direction() * 0.1f, vec3(1), i % 4 == 1)
                     : point(a, 0.05f),
               random(0.1f, 2));
  }
  const auto seconds = [](auto&& what) {
    const std::clock_t start = std::clock();  // of all threads: what others do on the machine does not count
    what();
    return double(std::clock() - start) / CLOCKS_PER_SEC;
  };
  LightTree t;
  const double one = seconds([&] { t = build_light_tree(lights.input(1)); });
  const double all = seconds([&] { t = build_light_tree(lights.input(0)); });
  const double again = seconds([&] { refit_light_tree(t, lights.input(0)); });
  MESSAGE("processor time: build on one thread " << one << " s, on all " << all << " s; refit " << again << " s");
  const std::size_t bytes = t.nodes.size() * sizeof(LightTreeNode) + 4 * (t.order.size() + t.position.size());
  MESSAGE("bytes a light: " << double(bytes) / double(lights.records.size()));
}

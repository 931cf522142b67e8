// SPDX-License-Identifier: Apache-2.0
// The world-space grid: cells and their places in memory as the camera moves, neighbours, reservoirs in a cell, and
// positions and cameras that make no sense.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "lib/world_grid.h"

using namespace hw;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Random {
  std::mt19937 engine;
  explicit Random(uint seed) : engine(seed) {}
  float operator()() { return sampler_to_float(uint(engine())); }
  vec3 point(float reach, vec3 at = vec3(0)) {
    const float x = (*this)(), y = (*this)(), z = (*this)();
    return at + (vec3(x, y, z) * 2.0f - vec3(1)) * reach;
  }
};

bool inside(const WorldGrid& g, ivec3 c) {
  for (int a = 0; a < 3; ++a)
    if (c[a] < g.low[a] || c[a] >= g.low[a] + int(g.resolution)) return false;
  return true;
}

template <class F>
void for_cells(const WorldGrid& g, F f) {
  const int n = int(g.resolution);
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) f(grid_low(g) + ivec3(x, y, z));
}

}  // namespace

TEST_CASE("cells are cubes of 2 extent / resolution; world cells are counted from the world's origin") {
  Random random(1);
  for (uint n : {1u, 2u, 7u, 64u}) {
    for (vec3 camera : {vec3(0), vec3(3.3f, -7.1f, 0.2f), vec3(-1000, 2000, 5)}) {
      const WorldGrid world = world_grid(camera, 5, n, 1, false), riding = world_grid(camera, 5, n, 1, true);
      const double s = 10.0 / n;
      CHECK(world.cell_size == doctest::Approx(s));
      ivec3 home(0);
      CHECK(grid_cell(world, camera, home));
      for (int a = 0; a < 3; ++a) CHECK(std::abs((world.low[a] + n / 2.0) * s - camera[a]) <= s * 0.501);
      int in_world = 0, in_riding = 0;
      for (int i = 0; i < 2000; ++i) {
        const vec3 P = random.point(7, camera);
        ivec3 cell(0);
        const bool found = grid_cell(world, P, cell);
        CHECK(inside(world, cell));
        CHECK(grid_project(world, P) == cell);
        in_world += found;
        for (int a = 0; a < 3; ++a) {
          const double lower = cell[a] * s, upper = (cell[a] + 1) * s, slack = 1e-3 * s;
          if (found) CHECK((P[a] > lower - slack && P[a] < upper + slack));
          // Outside: each coordinate is the nearest.
          if (!found && P[a] < lower - slack) CHECK(cell[a] == world.low[a]);
          if (!found && P[a] > upper + slack) CHECK(cell[a] == world.low[a] + int(n) - 1);
        }
        const bool rides = grid_cell(riding, P, cell);
        const vec3 d = abs(P - camera);
        const float furthest = std::max({d.x, d.y, d.z});
        if (std::abs(furthest - 5) > 1e-3f) CHECK(rides == (furthest < 5));
        in_riding += rides;
      }
      CHECK(in_riding > 500);
      CHECK(in_world > 200);  // of a single cell with the camera in a corner, an eighth
      CHECK(in_world < 1000);
    }
  }
}

TEST_CASE("every cell of the window has its own place in memory") {
  for (uint n : {1u, 2u, 5u, 16u}) {
    for (vec3 camera : {vec3(0), vec3(-0.01f), vec3(-33.3f, 12, 700), vec3(1e5f, -1e5f, 3)}) {
      for (bool riding : {false, true}) {
        const WorldGrid g = world_grid(camera, 4, n, 1, riding);
        std::set<uint> places;
        for_cells(g, [&](ivec3 c) {
          places.insert(grid_index(g, c));
          CHECK(grid_index(g, c) < n * n * n);
          CHECK(grid_tag(g, c) != 0);
        });
        CHECK(places.size() == n * n * n);
      }
    }
  }
}

TEST_CASE("cells that share a place have different tags") {
  for (uint n : {1u, 3u, 16u}) {
    const WorldGrid g = world_grid(vec3(1), 4, n, 1, false);
    std::set<uint> tags;
    const ivec3 cell(5, -3, 0);
    for (int z = -5; z <= 5; ++z) {
      for (int y = -5; y <= 5; ++y) {
        for (int x = -500; x <= 500; x += 10) {
          const ivec3 alias = cell + ivec3(x, y, z) * int(n);
          CHECK(grid_index(g, alias) == grid_index(g, cell));
          tags.insert(grid_tag(g, alias));
        }
      }
    }
    CHECK(tags.size() == 11 * 11 * 101);
    CHECK(tags.count(0) == 0);
    CHECK(tags.count(grid_tag(world_grid(vec3(1), 4, n, 1, true), cell)) == 0);
  }
}

TEST_CASE("a world cell keeps its place and tag while it stays in the window; a riding one its place by the camera") {
  Random random(2);
  vec3 camera(-3, 0.5f, 2);
  // What memory holds: the cell that each place was last claimed for, found by its tag alone.
  std::map<uint, uint> memory;
  std::set<std::tuple<int, int, int>> held;
  int kept = 0, fresh = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const WorldGrid g = world_grid(camera, 4, 8, 1, false);
    std::set<std::tuple<int, int, int>> now;
    for_cells(g, [&](ivec3 c) {
      const uint place = grid_index(g, c), tag = grid_tag(g, c);
      const bool valid = memory.count(place) && memory[place] == tag;
      const bool expected = held.count({c.x, c.y, c.z}) > 0;
      REQUIRE(valid == expected);
      (valid ? kept : fresh) += 1;
      memory[place] = tag;
      now.insert({c.x, c.y, c.z});
    });
    held = now;
    camera += random.point(1.5f);
  }
  CHECK(kept > 5000);
  CHECK(fresh > 5000);

  for (int i = 0; i < 200; ++i) {
    const vec3 eye = random.point(100), P = random.point(3.9f), P2 = P + eye;
    const WorldGrid a = world_grid(vec3(0), 4, 8, 1, true), b = world_grid(eye, 4, 8, 1, true);
    ivec3 ca(0), cb(0);
    REQUIRE(grid_cell(a, P, ca));
    REQUIRE(grid_cell(b, P2, cb));
    const vec3 off = fract((P - a.origin) * a.cells_a_metre);
    if (std::min({off.x, off.y, off.z}) < 1e-3f || std::max({off.x, off.y, off.z}) > 0.999f) continue;
    CHECK(ca == cb);
    CHECK(grid_tag(a, ca) == grid_tag(b, cb));
  }
}

TEST_CASE("a neighbour is any other cell within the radius and the grid, with equal odds") {
  std::mt19937 engine(5);
  Random random(6);
  for (bool riding : {false, true}) {
    const WorldGrid g = world_grid(vec3(-7.7f, 3, 0.4f), 4, 9, 1, riding);
    for (uint radius : {1u, 2u, 10u, 0xFFFFFFFFu}) {
      for (ivec3 at : {ivec3(4, 4, 4), ivec3(0, 0, 0), ivec3(8, 0, 3), ivec3(7, 8, 8)}) {
        CAPTURE(radius);
        const ivec3 cell = grid_low(g) + at;
        std::map<std::tuple<int, int, int>, int> counts;
        int cells = 0;
        for_cells(g, [&](ivec3 c) {
          const ivec3 d = abs(c - cell);
          if (c != cell && uint(std::max({d.x, d.y, d.z})) <= radius) counts[{c.x, c.y, c.z}] = 0, ++cells;
        });
        const int draws = cells * 100;
        for (int i = 0; i < draws; ++i) {
          const float x = random(), y = random(), z = random();
          const ivec3 c = grid_neighbour(g, cell, radius, vec3(x, y, z));
          const auto found = counts.find({c.x, c.y, c.z});
          REQUIRE(found != counts.end());
          ++found->second;
        }
        double chi = 0;
        for (const auto& [c, n] : counts) chi += (n - 100.0) * (n - 100.0) / 100.0;
        CHECK(std::abs(chi - (cells - 1)) < 4.5 * std::sqrt(2.0 * (cells - 1)));
        // Both ends of the range reach the ends of the box.
        CHECK(inside(g, grid_neighbour(g, cell, radius, vec3(0))));
        CHECK(inside(g, grid_neighbour(g, cell, radius, vec3(0.99999994f))));
      }
    }
    CHECK(grid_neighbour(g, grid_low(g), 0, vec3(0.5f)).x == HW_GRID_NONE);
    CHECK(inside(g, grid_neighbour(g, ivec3(1 << 30), 3, vec3(0.5f))));
  }
  const WorldGrid one = world_grid(vec3(2), 4, 1, 1, false);
  CHECK(grid_neighbour(one, grid_low(one), 10, vec3(0.5f)).x == HW_GRID_NONE);
  // A box of more cells than a float counts: both halves of the last axis, and odd and even cells, equally often.
  const WorldGrid large = world_grid(vec3(0), 4, HW_GRID_MAX_RESOLUTION, 1, false);
  int odd[3] = {0, 0, 0}, upper[3] = {0, 0, 0};
  const int draws = 100000;
  for (int i = 0; i < draws; ++i) {
    const float x = random(), y = random(), z = random();
    const ivec3 c = grid_neighbour(large, ivec3(0), 2000, vec3(x, y, z));
    REQUIRE(inside(large, c));
    for (int a = 0; a < 3; ++a) odd[a] += c[a] & 1, upper[a] += c[a] >= 0;
  }
  for (int a = 0; a < 3; ++a) {
    CHECK(std::abs(odd[a] - draws / 2.0) < 4 * std::sqrt(draws / 4.0));
    CHECK(std::abs(upper[a] - draws / 2.0) < 4 * std::sqrt(draws / 4.0));
  }
}

TEST_CASE("the reservoirs of a cell part it among them") {
  Random random(8);
  for (uint slots : {1u, 2u, 5u, 16u}) {
    const WorldGrid g = world_grid(vec3(10, -20, 30), 4, 8, slots, false);
    const WorldGrid moved = world_grid(vec3(11, -19, 30.5f), 4, 8, slots, false);
    std::vector<int> taken(slots, 0);
    std::set<uint> all;
    for (int i = 0; i < 20000; ++i) {
      const vec3 P = random.point(3, vec3(10, -20, 30));
      ivec3 cell(0), again(0);
      REQUIRE(grid_cell(g, P, cell));
      const uint slot = grid_slot(g, cell, P);
      REQUIRE(slot < slots);
      ++taken[slot];
      all.insert(grid_reservoir(g, cell, P));
      REQUIRE(grid_reservoir(g, cell, P) / slots == grid_index(g, cell));
      if (grid_cell(moved, P, again)) REQUIRE(grid_reservoir(moved, again, P) == grid_reservoir(g, cell, P));
    }
    for (int n : taken) CHECK(n > 20000 / int(slots) * 3 / 4);  // sites are random, and so even over many cells
    if (slots > 1) CHECK(all.size() > 216 * slots * 3 / 4);
    // Nearby points share a reservoir: regions, not noise.
    int same = 0;
    for (int i = 0; i < 2000; ++i) {
      const vec3 P = random.point(3, vec3(10, -20, 30)), Q = P + random.point(0.01f);
      const ivec3 a = grid_project(g, P), b = grid_project(g, Q);
      same += grid_reservoir(g, a, P) == grid_reservoir(g, b, Q);
    }
    CHECK(same > 1700);
    CHECK(grid_slot(g, grid_low(g), vec3(kNan)) < slots);
    CHECK(grid_slot(g, grid_low(g), vec3(kInf)) < slots);
    CHECK(grid_slot(g, grid_low(g), vec3(1e30f)) < slots);
  }
}

TEST_CASE("positions, cameras and settings that make no sense give an answer") {
  const float values[] = {kNan, kInf, -kInf, 3e38f, -3e38f, 1e12f, -1e12f, 0, 1};
  const vec3 cameras[] = {vec3(0), vec3(kNan, 0, 0), vec3(0, kInf, 0), vec3(0, 0, -kInf), vec3(3e38f), vec3(-3e38f)};
  for (vec3 camera : cameras) {
    for (float extent : {1.0f, 0.0f, -1.0f, kNan, kInf, 1e-30f, 1e30f}) {
      for (uint n : {0u, 1u, 64u, 5000u}) {
        for (bool riding : {false, true}) {
          const WorldGrid g = world_grid(camera, extent, n, 0, riding);
          REQUIRE(g.resolution >= 1);
          REQUIRE(g.resolution <= HW_GRID_MAX_RESOLUTION);
          REQUIRE(g.slots == 1);
          REQUIRE(std::isfinite(g.cells_a_metre));
          for (float x : values) {
            ivec3 cell(0);
            const bool found = grid_cell(g, vec3(0, x, 0), cell);
            REQUIRE(inside(g, cell));
            REQUIRE(grid_index(g, cell) < g.resolution * g.resolution * g.resolution);
            REQUIRE(grid_tag(g, cell) != 0);
            if (std::isnan(x)) REQUIRE_FALSE(found);
            if (std::isinf(x)) REQUIRE_FALSE(found);
            REQUIRE(inside(g, grid_project(g, vec3(x, 1, x))));
          }
        }
      }
    }
  }
  const WorldGrid g = world_grid(vec3(kNan), 8, 16, 1, false);
  ivec3 cell(0);
  CHECK(grid_cell(g, vec3(1, 2, 3), cell));  // as if the camera were at the origin
  CHECK(cell == ivec3(1, 2, 3));
  CHECK_FALSE(grid_cell(g, vec3(2e9f, 2, 3), cell));
  CHECK(cell == ivec3(7, 2, 3));
  CHECK_FALSE(grid_cell(g, vec3(-kInf, 2, 3), cell));
  CHECK(cell == ivec3(-8, 2, 3));
  CHECK(world_grid(vec3(0), 8, 99999, 99, false).slots == HW_GRID_MAX_SLOTS);
  // A camera further out than cells are counted sees no cell of its own.
  CHECK_FALSE(grid_cell(world_grid(vec3(1e30f, 0, 0), 8, 16, 1, false), vec3(1e30f, 0, 0), cell));
}

TEST_CASE("division of negative coordinates rounds down") {
  for (int c : {-2147483647, -1025, -9, -8, -7, -1, 0, 1, 7, 8, 9, 2147483646}) {
    for (uint n : {1u, 7u, 8u, 1024u}) {
      CHECK(grid_wraps(c, n) == int(std::floor(double(c) / n)));
      CHECK(std::int64_t(grid_wraps(c, n)) * n + grid_modulo(c, n) == c);
    }
  }
}

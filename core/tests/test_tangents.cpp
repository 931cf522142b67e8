// SPDX-License-Identifier: Apache-2.0
// Tangents of UV maps: who shares one, by what weight, on how many threads; bad maps; as a scene makes them.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "scene/scene_impl.h"
#include "scene/tangents.h"

namespace {

using namespace hw;

struct TriangleMesh {
  std::vector<float> positions, normals, uv;  // per vertex, corner, corner
  std::vector<std::uint32_t> vertices, corners;

  std::vector<float> tangents(int threads = 1) const {
    return corner_tangents({.positions = positions,
                            .normals = normals,
                            .tri_vertices = vertices,
                            .tri_corners = corners,
                            .corners_in_order = corners.empty(),
                            .uv = uv,
                            .corner_count = uv.size() / 2},
                           threads);
  }
};

// A unit square in z = 0 whose map is its x and y; corners in order.
TriangleMesh square() {
  TriangleMesh mesh;
  mesh.positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  mesh.vertices = {0, 1, 2, 0, 2, 3};
  mesh.uv = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
  for (int c = 0; c < 6; ++c) mesh.normals.insert(mesh.normals.end(), {0, 0, 1});
  return mesh;
}

std::array<float, 4> at(const std::vector<float>& tangents, std::size_t corner) {
  return {tangents[4 * corner], tangents[4 * corner + 1], tangents[4 * corner + 2], tangents[4 * corner + 3]};
}

void check_near(std::array<float, 4> found, std::array<float, 4> expected) {
  for (std::size_t k = 0; k < 4; ++k) CHECK(found[k] == doctest::Approx(expected[k]).epsilon(1e-5));
}

// Triangles over a bumpy grid of `side` squares, mapped by a bent map that is mirrored in one half; corners in order.
TriangleMesh bumps(std::uint32_t side) {
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= side; ++y)
    for (std::uint32_t x = 0; x <= side; ++x)
      mesh.positions.insert(mesh.positions.end(), {float(x), float(y), std::sin(0.7f * x) * std::cos(0.4f * y)});
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = y * (side + 1) + x, b = a + 1, c = b + side + 1, d = a + side + 1;
      for (std::uint32_t v : {a, b, c, a, c, d}) mesh.vertices.push_back(v);
    }
  for (std::uint32_t v : mesh.vertices) {
    const float x = mesh.positions[3 * v], y = mesh.positions[3 * v + 1];
    mesh.uv.insert(mesh.uv.end(), {std::abs(x - 0.5f * side) + 0.1f * std::sin(y), y + 0.2f * std::cos(x)});
    const float n[3] = {-0.1f * std::cos(x), 0.1f * std::sin(y), 1};
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    mesh.normals.insert(mesh.normals.end(), {n[0] / length, n[1] / length, n[2] / length});
  }
  return mesh;
}

bool usable(const std::vector<float>& tangents) {
  for (std::size_t c = 0; c < tangents.size() / 4; ++c) {
    const auto [x, y, z, sign] = at(tangents, c);
    const float square = x * x + y * y + z * z;
    if (!(square == 0 || std::abs(square - 1) < 1e-5f) || std::abs(sign) != 1) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("tangents: along u, with the map's handedness") {
  TriangleMesh mesh = square();
  for (std::size_t c = 0; c < 6; ++c) check_near(at(mesh.tangents(), c), {1, 0, 0, 1});
  for (std::size_t c = 0; c < 6; ++c) mesh.uv[2 * c] *= -1;  // mirrored
  for (std::size_t c = 0; c < 6; ++c) check_near(at(mesh.tangents(), c), {-1, 0, 0, -1});
  for (std::size_t c = 0; c < 6; ++c) std::swap(mesh.uv[2 * c], mesh.uv[2 * c + 1]);  // u along y, v against x
  for (std::size_t c = 0; c < 6; ++c) check_near(at(mesh.tangents(), c), {0, 1, 0, 1});
}

TEST_CASE("tangents: flat meshes take the triangles' own planes") {
  TriangleMesh mesh = square();
  mesh.normals.clear();
  mesh.positions[3 * 3 + 2] = 1;  // the fourth vertex is lifted
  const auto tangents = mesh.tangents();
  check_near(at(tangents, 0), {1, 0, 0, 1});
  const auto [x, y, z, sign] = at(tangents, 3);
  // Across the normal (1, -1, 1) of the second triangle, and not the first one's.
  CHECK(x - y + z == doctest::Approx(0).epsilon(1e-5));
  CHECK(z != doctest::Approx(0).epsilon(1e-3));
}

TEST_CASE("tangents: corners that agree share one, weighted by angle") {
  // Two triangles at the origin, 90 degrees along x and 45 degrees with u turned by 90.
  TriangleMesh mesh;
  mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 1, 0};
  mesh.vertices = {0, 1, 2, 0, 2, 3};
  for (int c = 0; c < 6; ++c) mesh.normals.insert(mesh.normals.end(), {0, 0, 1});
  mesh.uv = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1};  // the second: u along y, v along -x
  const auto tangents = mesh.tangents();
  const float length = std::sqrt(5.0f);
  check_near(at(tangents, 0), {2 / length, 1 / length, 0, 1});
  CHECK(at(tangents, 0) == at(tangents, 3));
  check_near(at(tangents, 1), {1, 0, 0, 1});

  SUBCASE("not where the normals differ") {
    mesh.normals[3 * 3] = 0.6f, mesh.normals[3 * 3 + 2] = 0.8f;
    check_near(at(mesh.tangents(), 0), {1, 0, 0, 1});
  }
  SUBCASE("not where the UVs differ") {
    for (std::size_t c = 3; c < 6; ++c) mesh.uv[2 * c + 1] += 3;
    check_near(at(mesh.tangents(), 0), {1, 0, 0, 1});
    check_near(at(mesh.tangents(), 3), {0, 1, 0, 1});
  }
  SUBCASE("not where one is mirrored") {
    mesh.uv = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, -1};
    check_near(at(mesh.tangents(), 0), {1, 0, 0, 1});
    CHECK(at(mesh.tangents(), 3)[3] == -1);
  }
  SUBCASE("vertices at one place count as one, -0 as 0") {
    mesh.positions.insert(mesh.positions.end(), {-0.0f, 0, -0.0f});
    mesh.vertices[3] = 4;
    mesh.uv[6] = -0.0f;
    CHECK(mesh.tangents() == tangents);
  }
}

TEST_CASE("tangents: a triangle without area in the map takes its neighbours'") {
  TriangleMesh mesh = square();
  for (std::size_t c = 3; c < 6; ++c) mesh.uv[2 * c] = mesh.uv[2 * c + 1] = 0;  // all at the first corner's place
  for (bool mirrored : {false, true}) {
    if (mirrored)
      for (std::size_t c = 0; c < 6; ++c) mesh.uv[2 * c] *= -1;
    const auto tangents = mesh.tangents();
    check_near(at(tangents, 3), {mirrored ? -1.0f : 1.0f, 0, 0, mirrored ? -1.0f : 1.0f});
    check_near(at(tangents, 5), {0, 0, 0, 1});  // a corner that no other agrees with
  }
}

TEST_CASE("tangents: a corner of several triangles takes the last one's; corners of none are zero") {
  TriangleMesh mesh = square();
  mesh.corners = {0, 1, 2, 0, 2, 3};
  mesh.uv = {0, 0, 1, 0, 1, 1, 0, 2, 7, 7};
  mesh.normals.resize(15);
  const auto tangents = mesh.tangents();
  CHECK(tangents.size() == 20);
  CHECK(usable({tangents.begin(), tangents.begin() + 16}));
  CHECK(at(tangents, 4) == std::array<float, 4>{0, 0, 0, 0});
}

TEST_CASE("tangents: the same on any number of threads") {
  const TriangleMesh mesh = bumps(160);
  const auto one = mesh.tangents(1);
  CHECK(usable(one));
  for (int threads : {2, 3, 7, 40}) CHECK(mesh.tangents(threads) == one);
}

TEST_CASE("tangents: bad maps and places give unit vectors or zero") {
  std::mt19937 random(1);
  const float odd[] = {0, -0.0f, 1, -1, 1e-45f, 1e-38f, 3e38f, -3e38f, 1e20f, 0.5f};
  const auto pick = [&] { return odd[random() % std::size(odd)]; };
  for (int round = 0; round < 300; ++round) {
    TriangleMesh mesh = bumps(3);
    for (float& p : mesh.positions)
      if (random() % 2) p = pick();
    for (float& u : mesh.uv)
      if (random() % 2) u = pick();
    for (float& n : mesh.normals)
      if (random() % 8 == 0) n = pick() * 1e-2f;
    if (round % 3 == 0) mesh.normals.clear();
    if (round % 5 == 0) std::fill(mesh.vertices.begin(), mesh.vertices.end(), 0);
    const auto tangents = mesh.tangents();
    REQUIRE(usable(tangents));
  }
}

namespace {

MeshData square_data() {
  const TriangleMesh mesh = square();
  MeshData data;
  data.name = "square";
  data.positions = mesh.positions;
  data.tri_vertices = mesh.vertices;
  data.tri_corners = {0, 1, 2, 3, 4, 5};
  data.attributes = {{"uv", HW_DOMAIN_CORNER, 2, mesh.uv}, {"gray", HW_DOMAIN_VERTEX, 1, {0, 1, 2, 3}}};
  data.tangents = {{"uv.tangent", 0}};
  return data;
}

std::string refusal(const std::function<void(MeshData&)>& spoil) {
  Scene scene;
  MeshData data = square_data();
  spoil(data);
  try {
    scene.upsert_mesh(1, data);
  } catch (const SceneError& error) {
    CHECK_FALSE(scene.has_mesh(1));
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("tangents: a scene makes them at the commit, as an attribute of corners") {
  Scene scene;
  scene.upsert_mesh(1, square_data());
  MeshData broken = square_data();
  broken.attributes[0].data[3] = std::numeric_limits<float>::quiet_NaN();  // becomes the 0 that it was
  scene.upsert_mesh(2, broken);
  MeshData vertices = square_data();
  vertices.tri_corners.clear();
  vertices.attributes[0] = {"uv", HW_DOMAIN_VERTEX, 3, {0, 0, 5, 1, 0, 6, 1, 1, 7, 0, 1, 8}};
  scene.upsert_mesh(3, vertices);
  scene.commit();
  for (Id id : {1, 2, 3}) {
    const MeshEntry& entry = scene.impl().meshes.at(id);
    REQUIRE(entry.data.attributes.size() == 3);
    CHECK(entry.data.attributes[2].name == "uv.tangent");
    CHECK(entry.data.attributes[2].domain == HW_DOMAIN_CORNER);
    CHECK(entry.data.attributes[2].components == 4);
    const auto values = entry.arrays.attributes[2];
    REQUIRE(values.size() == (id == 3 ? 16 : 24));
    for (std::size_t c = 0; c < values.size() / 4; ++c) check_near(at({values.begin(), values.end()}, c), {1, 0, 0, 1});
  }
  const float* made = scene.impl().meshes.at(1).arrays.attributes[2].data();
  scene.commit();
  CHECK(scene.impl().meshes.at(1).arrays.attributes[2].data() == made);  // once a mesh that is set
}

TEST_CASE("tangents: many meshes, small and large, are made on any number of threads") {
  for (int threads : {1, 3}) {
    Scene scene;
    for (Id id = 1; id <= 20; ++id) {
      const TriangleMesh mesh = bumps(id == 20 ? 160 : static_cast<std::uint32_t>(id));
      MeshData data;
      data.positions = mesh.positions, data.tri_vertices = mesh.vertices, data.normals = mesh.normals;
      for (std::uint32_t c = 0; c < mesh.vertices.size(); ++c) data.tri_corners.push_back(c);
      data.attributes = {{"uv", HW_DOMAIN_CORNER, 2, mesh.uv}};
      data.tangents = {{"t", 0}};
      scene.upsert_mesh(id, std::move(data));
    }
    scene.commit(threads);
    for (Id id = 1; id <= 20; ++id) {
      const auto values = scene.impl().meshes.at(id).arrays.attributes[1];
      CHECK(std::vector<float>(values.begin(), values.end()) ==
            bumps(id == 20 ? 160 : static_cast<std::uint32_t>(id)).tangents());
    }
  }
}

TEST_CASE("tangents: what can't be made is refused") {
  CHECK(refusal([](MeshData&) {}).empty());
  CHECK(refusal([](MeshData& m) { m.tangents[0].uv = 2; }).find("attribute 2: there are 2") != std::string::npos);
  CHECK(refusal([](MeshData& m) { m.tangents[0].uv = 1; }).find("\"gray\", which is no UV map") != std::string::npos);
  CHECK(refusal([](MeshData& m) { m.tangents[0].name = "uv"; }).find("given twice") != std::string::npos);
  CHECK(refusal([](MeshData& m) { m.tangents[0].name = ""; }).find("no name") != std::string::npos);
  CHECK(refusal([](MeshData& m) {
          for (int i = 0; i < 6; ++i) m.tangents.push_back({"t" + std::to_string(i), 0});
        }).find("9 attributes") != std::string::npos);
  CHECK(refusal([](MeshData& m) {
          m.attributes[0] = {"uv", HW_DOMAIN_VERTEX, 2, std::vector<float>(8)};
          m.tri_corners[5] = 100'000'000;
        }).find("which no array has") != std::string::npos);
}

// SPDX-License-Identifier: Apache-2.0
// Scene edits without a device: what is refused, what counts as a change, where last frame's places come from.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "scene/scene_impl.h"
#include "scene/tables_impl.h"
#include "shared/material_program.h"

namespace {

using namespace hw;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr Matrix34 kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

Matrix34 at(float x, float y = 0, float z = 0) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}; }

MeshData quad(float size = 1) {
  MeshData mesh;
  mesh.name = "quad";
  mesh.positions = {-size, -size, 0, size, -size, 0, size, size, 0, -size, size, 0};
  mesh.tri_vertices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

InstanceData instance_of(Id mesh, Matrix34 matrix = kIdentity) {
  InstanceData data;
  data.name = "thing";
  data.mesh = mesh;
  data.object_to_world = matrix;
  return data;
}

CameraData camera() {
  CameraData c{};
  std::copy(kIdentity.begin(), kIdentity.end(), c.camera_to_world);
  c.left = c.bottom = -1, c.right = c.top = 1;
  c.clip_start = 0.1f, c.clip_end = 100, c.focus_distance = 1, c.aperture_ratio = 1;
  return c;
}

// The message of the SceneError that `edit` throws; empty when it throws none.
std::string refusal(const std::function<void()>& edit) {
  try {
    edit();
  } catch (const SceneError& error) {
    return error.what();
  }
  return {};
}

const InstanceGroup& group(const Scene& scene, Id id) { return *scene.impl().find_group(id); }

Matrix34 previous(const Scene& scene, Id id) {
  Id first = 0;
  const InstanceGroup& g = *scene.impl().find_group(id, &first);
  return g.previous.empty() ? g.matrices[id - first] : g.previous[id - first];
}

}  // namespace

TEST_CASE("scene: bad meshes are refused by name and reason") {
  struct Case {
    const char* reason;
    std::function<void(MeshData&)> spoil;
  };
  const Case cases[] = {
      {"not finite", [](MeshData& m) { m.positions[4] = kNan; }},
      {"not finite", [](MeshData& m) { m.positions[4] = -kInf; }},
      {"vertex 4 of 4", [](MeshData& m) { m.tri_vertices[5] = 4; }},
      {"three numbers a vertex", [](MeshData& m) { m.positions.pop_back(); }},
      {"three indices", [](MeshData& m) { m.tri_vertices.pop_back(); }},
      {"vertex 0 of 0", [](MeshData& m) { m.positions.clear(), m.tri_vertices.assign(3, 0); }},
      {"tri_corners",
       [](MeshData& m) {
         m.tri_corners = {0, 1, 2};
       }},
      {"2147483647", [](MeshData& m) { m.tri_corners = {0, 1, 2, 3, 4, 0x7fffffffu}; }},
      {"3 normals for 4", [](MeshData& m) { m.normals.assign(9, 1); }},
      {"5 normals for 6", [](MeshData& m) { m.tri_corners = {0, 1, 2, 3, 4, 5}, m.normals.assign(15, 1); }},
      {"tri_slots has 1", [](MeshData& m) { m.tri_slots = {0}; }},
      {"3 elements for 4 vertices",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_VERTEX, 2, std::vector<float>(6)}};
       }},
      {"3 elements for 2 triangles",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_FACE, 1, std::vector<float>(3)}};
       }},
      {"3 elements for 4 corners",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_CORNER, 2, std::vector<float>(6)}};
       }},
      {"5 components",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_VERTEX, 5, std::vector<float>(20)}};
       }},
      {"0 components",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_VERTEX, 0, {}}};
       }},
      {"part of an element",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_VERTEX, 2, std::vector<float>(7)}};
       }},
      {"unknown domain",
       [](MeshData& m) {
         m.attributes = {{"a", 9, 1, std::vector<float>(4)}};
       }},
      {"no name",
       [](MeshData& m) {
         m.attributes = {{"", HW_DOMAIN_VERTEX, 1, std::vector<float>(4)}};
       }},
      {"given twice",
       [](MeshData& m) {
         m.attributes.assign(2, {"a", HW_DOMAIN_VERTEX, 1, std::vector<float>(4)});
       }},
      {"9 attributes",
       [](MeshData& m) {
         for (int i = 0; i < 9; ++i)
           m.attributes.push_back({"a" + std::to_string(i), HW_DOMAIN_VERTEX, 1, std::vector<float>(4)});
       }},
      {"default_uv is 0", [](MeshData& m) { m.default_uv = 0; }},
      {"default_uv is -2", [](MeshData& m) { m.default_uv = -2; }},
      {"one component",
       [](MeshData& m) {
         m.attributes = {{"a", HW_DOMAIN_VERTEX, 1, std::vector<float>(4)}}, m.default_uv = 0;
       }},
  };
  for (const Case& c : cases) {
    CAPTURE(c.reason);
    Scene scene;
    scene.upsert_mesh(7, quad(2));
    scene.commit();
    MeshData mesh = quad();
    c.spoil(mesh);
    const std::string message = refusal([&] { scene.upsert_mesh(7, mesh); });
    CHECK(message.find("\"quad\" (id 7)") != std::string::npos);
    CHECK_MESSAGE(message.find(c.reason) != std::string::npos, message);
    CHECK(scene.impl().meshes.at(7).arrays.positions[0] == -2);  // as it was
    CHECK_FALSE(scene.commit().any());
  }
}

TEST_CASE("scene: broken shading data is repaired") {
  Scene scene;
  MeshData mesh = quad();
  mesh.normals = {0, 0, 1, kNan, 0, 0, 0, 0, 0, 0, kInf, 0};
  mesh.attributes = {{"uv", HW_DOMAIN_CORNER, 2, {0, kNan, 1, -kInf, kInf, 1, 0, 1}}};
  mesh.default_uv = 0;
  scene.upsert_mesh(1, mesh);
  const MeshArrays& arrays = scene.impl().meshes.at(1).arrays;
  for (int corner = 0; corner < 4; ++corner)
    for (int axis = 0; axis < 3; ++axis) CHECK(arrays.normals[3 * corner + axis] == (axis == 2 ? 1.0f : 0.0f));
  const float expected[] = {0, 0, 1, 0, 0, 1, 0, 1};
  for (int i = 0; i < 8; ++i) CHECK(arrays.attributes[0][i] == expected[i]);
  // A triangle without area has no normal to give: any unit vector.
  MeshData flat = quad(0);
  flat.normals.assign(12, 0);
  scene.upsert_mesh(2, flat);
  const MeshArrays& repaired = scene.impl().meshes.at(2).arrays;
  CHECK(std::hypot(repaired.normals[0], repaired.normals[1], repaired.normals[2]) == doctest::Approx(1));
}

TEST_CASE("scene: an empty mesh is allowed") {
  Scene scene;
  MeshData none;
  none.name = "none";
  scene.upsert_mesh(1, none);
  scene.upsert_instance(1, instance_of(1));
  CHECK(scene.impl().meshes.at(1).summary.triangle_count == 0);
}

TEST_CASE("scene: bad instances, lights, images, materials, cameras, worlds are refused") {
  const auto light = [](auto spoil) {
    LightData data;
    data.name = "lamp";
    data.object_to_world = kIdentity;
    spoil(data);
    return data;
  };
  const auto image = [](std::uint32_t w, std::uint32_t h, std::uint32_t format, std::size_t bytes) {
    ImageData data;
    data.name = "picture";
    data.width = w, data.height = h, data.format = format;
    data.texels.resize(bytes);
    return data;
  };
  const auto cam = [](auto spoil) {
    CameraData data = camera();
    spoil(data);
    return data;
  };
  struct Case {
    const char* message;
    std::function<void(Scene&)> edit;
  };
  const Case cases[] = {
      {"instance \"thing\" (id 5): no mesh has id 9", [](Scene& s) { s.upsert_instance(5, instance_of(9)); }},
      {"no material has id 4",
       [](Scene& s) {
         auto i = instance_of(1);
         i.materials = {4};
         s.upsert_instance(5, i);
       }},
      {"(id 5): its matrix", [](Scene& s) { s.upsert_instance(5, instance_of(1, at(kNan))); }},
      {"(id 6): its matrix",
       [](Scene& s) {
         const Matrix34 rows[2] = {kIdentity, at(0, kInf)};
         s.upsert_instances(5, instance_of(1), rows[0].data(), nullptr, 2);
       }},
      {"color",
       [](Scene& s) {
         auto i = instance_of(1);
         i.color[1] = kNan;
         s.upsert_instance(5, i);
       }},
      {"visibility",
       [](Scene& s) {
         auto i = instance_of(1);
         i.visibility = HW_MASK_LAMP;
         s.upsert_instance(5, i);
       }},
      {"shadow_terminator_offset",
       [](Scene& s) {
         auto i = instance_of(1);
         i.shadow_terminator_offset = kNan;
         s.upsert_instance(5, i);
       }},
      {"largest id",
       [](Scene& s) {
         const Matrix34 rows[2] = {kIdentity, kIdentity};
         s.upsert_instances(~Id{0} - 1, instance_of(1), rows[0].data(), nullptr, 2);
       }},
      {"light \"lamp\" (id 3): its matrix",
       [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.object_to_world[3] = kNan; })); }},
      {"color", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.color[0] = kInf; })); }},
      {"power", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.power = kNan; })); }},
      {"radius is -1", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.radius = -1; })); }},
      {"size_y", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.size_y = kNan; })); }},
      {"angle", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.angle = 7; })); }},
      {"spread", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.spread = -1; })); }},
      {"spot_blend", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.spot_blend = 2; })); }},
      {"unknown kind", [&](Scene& s) { s.upsert_light(3, light([](auto& l) { l.type = HW_LIGHT_WORLD; })); }},
      {"image \"picture\" (id 2): 15 bytes for 2 x 2",
       [&](Scene& s) { s.upsert_image(2, image(2, 2, HW_TEXEL_RGBA8, 15)); }},
      {"64 are needed", [&](Scene& s) { s.upsert_image(2, image(2, 2, HW_TEXEL_RGBA32F, 16)); }},
      {"unknown texel format", [&](Scene& s) { s.upsert_image(2, image(1, 1, 17, 4)); }},
      {"size is 0 x 2", [&](Scene& s) { s.upsert_image(2, image(0, 2, HW_TEXEL_R8, 0)); }},
      {"too large", [&](Scene& s) { s.upsert_image(2, image(70000, 1, HW_TEXEL_R8, 70000)); }},
      {"too large", [&](Scene& s) { s.upsert_image(2, image(65536, 65536, HW_TEXEL_R8, 0)); }},
      {"missing image", [&](Scene& s) { s.upsert_image(0, image(1, 1, HW_TEXEL_R8, 1)); }},
      {"material (id 8): no image has id 3",
       [](Scene& s) {
         MaterialData m;
         m.images = {3};
         s.upsert_material(8, m);
       }},
      {"built-in", [](Scene& s) { s.upsert_material(0, MaterialData{}); }},
      {"four numbers",
       [](Scene& s) {
         MaterialData m;
         m.constants = {1};
         s.upsert_material(8, m);
       }},
      {"emission",
       [](Scene& s) {
         MaterialData m;
         m.emission[2] = kNan;
         s.upsert_material(8, m);
       }},
      {"its program can't be used",
       [](Scene& s) {
         MaterialData m;
         m.program = {1, 2, 3, 4};
         s.upsert_material(8, m);
       }},
      {"its program can't be used",
       [](Scene& s) {
         MaterialData m = default_material();
         m.constants.resize(4);  // the program reads three
         s.upsert_material(8, m);
       }},
      {"world \"\": no material has id 8",
       [](Scene& s) {
         WorldData w;
         w.material = 8;
         s.set_world(w);
       }},
      {"color",
       [](Scene& s) {
         WorldData w;
         w.color[0] = kNan;
         s.set_world(w);
       }},
      {"importance_width",
       [](Scene& s) {
         WorldData w;
         w.importance_width = 1u << 20;
         s.set_world(w);
       }},
      {"camera: the picture plane has no area",
       [&](Scene& s) { s.set_camera(cam([](auto& c) { c.right = c.left; })); }},
      {"no area", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.top = -2; })); }},
      {"picture plane", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.top = kNan; })); }},
      {"its matrix", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.camera_to_world[7] = kInf; })); }},
      {"can't be inverted", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.camera_to_world[0] = 0; })); }},
      {"clip_end", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.clip_end = c.clip_start; })); }},
      {"clip_end", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.clip_end = kNan; })); }},
      {"clip_start", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.clip_start = -1; })); }},
      {"aperture_radius", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.aperture_radius = kNan; })); }},
      {"focus_distance",
       [&](Scene& s) { s.set_camera(cam([](auto& c) { c.aperture_radius = 1, c.focus_distance = 0; })); }},
      {"aperture_ratio", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.aperture_ratio = 0; })); }},
      {"unknown kind of camera", [&](Scene& s) { s.set_camera(cam([](auto& c) { c.type = 12; })); }},
      {"no mesh has id 33", [](Scene& s) { s.remove_mesh(33); }},
      {"no instance has id 33", [](Scene& s) { s.remove_instance(33); }},
      {"no instance has id 2", [](Scene& s) { s.remove_instances(1, 2); }},
      {"no light has id 33", [](Scene& s) { s.remove_light(33); }},
      {"no material has id 33", [](Scene& s) { s.remove_material(33); }},
      {"no image has id 33", [](Scene& s) { s.remove_image(33); }},
      {"mesh \"quad\" (id 1) is used by instance \"thing\" (id 1)", [](Scene& s) { s.remove_mesh(1); }},
      {"material (id 1) is used by instance", [](Scene& s) { s.remove_material(1); }},
      {"material (id 2) is used by the world", [](Scene& s) { s.remove_material(2); }},
      {"image (id 1) is used by material (id 1)", [](Scene& s) { s.remove_image(1); }},
  };
  for (const Case& c : cases) {
    CAPTURE(c.message);
    Scene scene;
    scene.upsert_image(1, ImageData{});
    MaterialData textured;
    textured.images = {1};
    scene.upsert_material(1, textured);
    scene.upsert_material(2, MaterialData{});
    WorldData world;
    world.material = 2;
    scene.set_world(world);
    scene.upsert_mesh(1, quad());
    InstanceData user = instance_of(1);
    user.materials = {1};
    scene.upsert_instance(1, user);
    scene.commit();
    const std::string message = refusal([&] { c.edit(scene); });
    CHECK_MESSAGE(message.find(c.message) != std::string::npos, message);
    CHECK_FALSE(scene.commit().any());
    CHECK(scene.impl().instance_count == 1);
  }
}

TEST_CASE("scene: commit says what changed, once") {
  Scene scene;
  CHECK_FALSE(scene.commit().any());
  scene.upsert_mesh(1, quad());
  scene.upsert_mesh(2, quad());
  Changes c = scene.commit();
  CHECK(c.meshes_set == std::vector<Id>{1, 2});
  CHECK_FALSE((c.instances || c.lights || c.materials || c.images || c.camera || c.world));
  CHECK_FALSE(scene.commit().any());

  scene.upsert_instance(1, instance_of(1));
  c = scene.commit();
  CHECK((c.instances && !c.transforms_only));
  scene.upsert_instance(1, instance_of(1));  // the same again
  CHECK_FALSE(scene.commit().any());
  scene.upsert_instance(1, instance_of(1, at(1)));
  c = scene.commit();
  CHECK((c.instances && c.transforms_only));
  c = scene.commit();  // it stands still now: motion ends
  CHECK((c.instances && c.transforms_only));
  CHECK_FALSE(scene.commit().any());
  InstanceData other = instance_of(1, at(1));
  other.object_index = 4;
  scene.upsert_instance(1, other);
  c = scene.commit();
  CHECK((c.instances && !c.transforms_only));

  scene.remove_mesh(2);
  CHECK(scene.commit().meshes_removed == std::vector<Id>{2});
  CHECK_FALSE(scene.has_mesh(2));
  LightData lamp;
  lamp.object_to_world = kIdentity;
  scene.upsert_light(1, lamp);
  CHECK(scene.commit().lights);
  scene.remove_light(1);
  CHECK(scene.commit().lights);
  scene.upsert_image(1, ImageData{});
  CHECK(scene.commit().images);
  scene.upsert_material(1, MaterialData{});
  CHECK(scene.commit().materials);
  scene.set_world(WorldData{});
  CHECK(scene.commit().world);
  scene.set_camera(camera());
  CHECK(scene.commit().camera);
  CHECK_FALSE(scene.commit().any());
  scene.clear();
  c = scene.commit();
  CHECK((c.instances && c.lights && c.materials && c.images && c.camera && c.world));
  CHECK(c.meshes_removed == std::vector<Id>{1});
}

TEST_CASE("scene: an instance keeps its last frame's place for one frame") {
  Scene scene;
  scene.upsert_mesh(1, quad());
  scene.upsert_instance(1, instance_of(1, at(1)));
  scene.upsert_instance(1, instance_of(1, at(2)));  // corrected within its first frame: it has no past
  scene.commit();
  CHECK(previous(scene, 1) == at(2));
  scene.upsert_instance(1, instance_of(1, at(3)));
  scene.upsert_instance(1, instance_of(1, at(4)));
  scene.commit();
  CHECK(group(scene, 1).matrices[0] == at(4));
  CHECK(previous(scene, 1) == at(2));
  scene.upsert_instance(1, instance_of(1, at(5)));
  scene.commit();
  CHECK(previous(scene, 1) == at(4));
  scene.commit();
  CHECK(previous(scene, 1) == at(5));
}

TEST_CASE("scene: ranges of instances are cut where other ranges overlap them") {
  Scene scene;
  scene.upsert_mesh(1, quad());
  scene.upsert_mesh(2, quad());
  std::vector<Matrix34> rows;
  for (int i = 0; i < 10; ++i) rows.push_back(at(float(i)));
  std::vector<std::uint32_t> random(10);
  std::iota(random.begin(), random.end(), 100);
  scene.upsert_instances(10, instance_of(1), rows[0].data(), random.data(), 10);
  scene.commit();
  CHECK(scene.impl().groups.size() == 1);
  CHECK(scene.impl().meshes.at(1).users == 10);

  // Ids 18 to 21: two that were there and two new ones.
  std::vector<Matrix34> moved{at(0, 8), at(0, 9), at(0, 10), at(0, 11)};
  scene.upsert_instances(18, instance_of(2), moved[0].data(), nullptr, 4);
  scene.commit();
  CHECK(scene.impl().instance_count == 12);
  CHECK(scene.impl().meshes.at(1).users == 8);
  CHECK(scene.impl().meshes.at(2).users == 4);
  CHECK(previous(scene, 17) == at(7));
  CHECK(previous(scene, 18) == at(8));
  CHECK(previous(scene, 19) == at(9));
  CHECK(previous(scene, 20) == at(0, 10));
  CHECK(scene.impl().find_group(17)->random_ids[7] == 107);
  CHECK(scene.impl().find_group(18)->shared.mesh == 2);

  scene.remove_instance(13);
  CHECK(scene.impl().find_group(13) == nullptr);
  CHECK(scene.impl().find_group(14)->random_ids[0] == 104);
  CHECK(scene.impl().instance_count == 11);
  CHECK(refusal([&] { scene.remove_instances(10, 5); }).find("no instance has id 13") != std::string::npos);
  CHECK(scene.impl().instance_count == 11);
  scene.remove_instances(10, 3);
  scene.remove_instances(14, 8);
  CHECK(scene.impl().instance_count == 0);
  CHECK(scene.impl().groups.empty());
  scene.remove_mesh(1);
  scene.remove_mesh(2);
}

TEST_CASE("scene: the camera keeps its last frame's place for one frame") {
  Scene scene;
  CameraData c = camera();
  c.camera_to_world[3] = 1;
  scene.set_camera(c);
  scene.commit();
  CHECK(scene.impl().camera.previous_world_to_camera[3] == -1);
  CHECK(scene.impl().camera.previous_right == 1);
  c.camera_to_world[3] = 2, c.right = 3;
  scene.set_camera(c);
  scene.set_camera(c);
  scene.commit();
  CHECK(scene.impl().camera.previous_world_to_camera[3] == -1);
  CHECK(scene.impl().camera.previous_right == 1);
  CHECK(scene.commit().camera);
  CHECK(scene.impl().camera.previous_world_to_camera[3] == -2);
  CHECK(scene.impl().camera.previous_right == 3);
  CHECK_FALSE(scene.commit().any());
}

TEST_CASE("scene: matrices as they are traced") {
  const Placement plain = place({2, 0, 0, 1, 0, 4, 0, 2, 0, 0, 8, 3});
  CHECK((plain.visible && !plain.mirrored));
  CHECK(plain.inverse[0] == 0.5f);
  CHECK(plain.inverse[3] == -0.5f);
  CHECK(place({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}).mirrored);

  // Flattened along z, and along a slanted axis: seen, with a finite inverse, at most 1e-4 of its size away.
  const float h = std::sqrt(0.5f);
  for (const Matrix34& flat :
       {Matrix34{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 5}, Matrix34{1, 0, h, 0, 0, 1, h, 0, 1, 1, 2 * h, 0}}) {
    const Placement p = place(flat);
    CHECK(p.visible);
    CHECK(all_finite(p.inverse, 12));
    for (int i = 0; i < 12; ++i) CHECK(std::abs(p.matrix[i] - flat[i]) < 2.1e-4f);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        double product = 0;
        for (int k = 0; k < 3; ++k) product += double{p.matrix[4 * r + k]} * p.inverse[4 * k + c];
        CHECK(product == doctest::Approx(r == c ? 1 : 0).epsilon(0.01).scale(1));
      }
  }
  for (const Matrix34& gone :
       {Matrix34{1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, Matrix34{}, Matrix34{1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0}}) {
    const Placement p = place(gone);
    CHECK_FALSE(p.visible);
    CHECK(all_finite(p.inverse, 12));
  }
}

TEST_CASE("scene: a million instances in well under a second") {
  Scene scene;
  scene.upsert_mesh(1, quad());
  const std::size_t count = 1'000'000;
  std::vector<Matrix34> rows(count, kIdentity);
  const auto start = std::chrono::steady_clock::now();
  scene.upsert_instances(1000, instance_of(1), rows[0].data(), nullptr, count);
  scene.commit();
  for (Matrix34& row : rows) row[3] += 1;
  scene.upsert_instances(1000, instance_of(1), rows[0].data(), nullptr, count);
  CHECK(scene.commit().transforms_only);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  CHECK(seconds < 1.0);
  CHECK(scene.impl().groups.size() == 1);
  CHECK(previous(scene, 1000 + count - 1) == kIdentity);
}

TEST_CASE("scene: attribute hashes are FNV-1a and never 0") {
  CHECK(attribute_hash("a") == 0xe40c292cu);  // published test vector
  CHECK(attribute_hash("foobar") == 0xbf9cf968u);
  CHECK(attribute_hash("") != 0);
}

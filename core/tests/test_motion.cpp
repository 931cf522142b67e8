// SPDX-License-Identifier: Apache-2.0
// What motion vectors rest on, in the tables: where instances, vertices and the camera were in the last frame, whatever
// else changes; and the keys by which an object is known from frame to frame.
#include <doctest/doctest.h>

#include <cstring>
#include <set>
#include <vector>

#include "table_rig.h"

namespace {

using namespace hw;
using namespace hw::table_rig;

CameraData camera_at(float x) {
  CameraData camera{};
  const Matrix34 matrix = at(x);
  std::memcpy(camera.camera_to_world, matrix.data(), sizeof(matrix));
  camera.left = camera.bottom = -1, camera.right = camera.top = 1;
  camera.clip_start = 0.1f, camera.clip_end = 100;
  camera.focus_distance = 1;
  camera.aperture_ratio = 1;
  return camera;
}

// Of the instance table's entry `i`: x of the last place and of the present one.
std::pair<float, float> path(const Rig& r, std::size_t i) {
  const InstanceRecord& record = r.see.instance(i);
  return {record.previous_object_to_world[3], record.object_to_world[3]};
}
using Path = std::pair<float, float>;

}  // namespace

TEST_CASE("motion: an instance moves, moves on, stands still") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_instance(1, instance_of(1, at(1)));
  r.update();
  CHECK(path(r, 0) == Path{1, 1});
  r.scene.upsert_instance(1, instance_of(1, at(2)));
  r.update();
  CHECK(path(r, 0) == Path{1, 2});
  r.scene.upsert_instance(1, instance_of(1, at(3)));
  r.update();
  CHECK(path(r, 0) == Path{2, 3});
  r.scene.upsert_instance(1, instance_of(1, at(3)));  // set again where it is
  r.update();
  CHECK(path(r, 0) == Path{3, 3});
  r.scene.upsert_instance(1, instance_of(1, at(4)));
  r.update();
  r.update();
  CHECK(path(r, 0) == Path{4, 4});
}

TEST_CASE("motion: a table laid out anew keeps the last places, and the keys") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  for (Id id = 10; id < 13; ++id) r.scene.upsert_instance(id, instance_of(1, at(float(id))));
  r.update();
  const std::uint32_t keys[3] = {r.see.instance(0).key, r.see.instance(1).key, r.see.instance(2).key};
  // One comes before, one goes, and one of those that stay moves in the same frame.
  r.scene.upsert_instance(3, instance_of(1, at(0)));
  r.scene.remove_instance(10);
  r.scene.upsert_instance(12, instance_of(1, at(20)));
  r.update();
  CHECK(path(r, 1) == Path{11, 11});
  CHECK(path(r, 2) == Path{12, 20});
  CHECK(r.see.instance(1).key == keys[1]);
  CHECK(r.see.instance(2).key == keys[2]);
  CHECK(r.see.instance(0).key == object_key(3));
  // It stands still while the table is laid out again, by another material's coming.
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 1));
  r.scene.upsert_instance(11, instance_of(1, at(11), {1}));
  r.update();
  CHECK(path(r, 1) == Path{11, 11});
  CHECK(path(r, 2) == Path{20, 20});
  // The other moves as it loses the material.
  r.scene.upsert_instance(11, instance_of(1, at(12)));
  r.update();
  CHECK(path(r, 1) == Path{11, 12});
  // Ids 11 and 12 become one group that moves; then one of them is cut out and stands still.
  const Matrix34 rows[2] = {at(30), at(31)};
  r.scene.upsert_instances(11, instance_of(1), rows[0].data(), nullptr, 2);
  r.update();
  CHECK(path(r, 1) == Path{12, 30});
  CHECK(path(r, 2) == Path{20, 31});
  CHECK(r.see.instance(1).key == keys[1]);
  CHECK(r.see.instance(2).key == keys[2]);
  r.scene.upsert_instance(12, instance_of(1, at(31)));
  r.update();
  CHECK(path(r, 1) == Path{30, 30});
  CHECK(path(r, 2) == Path{31, 31});
  // A table that failed and does it all again within the frame.
  r.scene.upsert_instance(12, instance_of(1, at(40)));
  MeshData large;
  large.name = "large";
  large.positions.assign(3'000'000, 0.0f);
  large.tri_vertices = {0, 1, 2};
  r.scene.upsert_mesh(2, large);
  device().set_memory_limit(device().bytes_in_use() + 1'000'000);
  CHECK_THROWS_AS(r.update(), OutOfMemory);
  device().set_memory_limit(0);
  r.tables.update();
  CHECK(path(r, 2) == Path{31, 40});
}

TEST_CASE("motion: keys differ, and none stands for no object") {
  std::set<std::uint32_t> keys;
  for (Id id = 0; id < 1000; ++id) {
    keys.insert(object_key(id));
    keys.insert(object_key((id + 1) << 32));  // ids that differ in the upper half alone
  }
  CHECK(keys.size() == 2000);
  CHECK_FALSE(keys.contains(HW_NONE));
}

TEST_CASE("motion: what is flat and stands still has none, in a group of which another moves") {
  Rig r;
  r.scene.upsert_mesh(1, quad(1));
  Matrix34 rows[2] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}, at(5)};
  r.scene.upsert_instances(1, instance_of(1), rows[0].data(), nullptr, 2);
  r.update();
  rows[1] = at(6);
  r.scene.upsert_instances(1, instance_of(1), rows[0].data(), nullptr, 2);
  r.update();
  const InstanceRecord& still = r.see.instance(0);
  CHECK(still.object_to_world[10] != 0);
  CHECK(std::memcmp(still.object_to_world, still.previous_object_to_world, sizeof(still.object_to_world)) == 0);
  CHECK(path(r, 1) == Path{5, 6});
  rows[0][3] = 1;  // it moves: as thick in its last place
  r.scene.upsert_instances(1, instance_of(1), rows[0].data(), nullptr, 2);
  r.update();
  CHECK(still.object_to_world[10] == still.previous_object_to_world[10]);
  CHECK(path(r, 0) == Path{0, 1});
}

TEST_CASE("motion: the camera's last place") {
  Rig r;
  const CameraRecord& camera = r.tables.root().camera;
  r.scene.set_camera(camera_at(1));
  r.update();
  CHECK(camera.previous_world_to_camera[3] == -1);
  CameraData next = camera_at(2);
  next.right = 3;
  r.scene.set_camera(next);
  r.scene.upsert_mesh(1, quad());  // and the table is laid out
  r.scene.upsert_instance(1, instance_of(1));
  r.update();
  CHECK(camera.camera_to_world[3] == 2);
  CHECK(camera.previous_world_to_camera[3] == -1);
  CHECK(camera.previous_right == 1);
  r.tables.choose_lights("uniform");
  CHECK(camera.previous_world_to_camera[3] == -1);
  r.update();
  CHECK(camera.camera_to_world[3] == 2);
  CHECK(camera.previous_world_to_camera[3] == -2);
  CHECK(camera.previous_right == 3);
  r.scene.set_camera(camera_at(4));
  r.update();
  CHECK(camera.previous_world_to_camera[3] == -2);
}

TEST_CASE("motion: a mesh that deforms while tables are laid out, and one that was set a frame ago") {
  Rig r;
  r.scene.upsert_mesh(1, quad(0));
  r.scene.upsert_mesh(2, quad(0));
  r.scene.upsert_instance(1, instance_of(1));
  r.update();
  const std::uint64_t first = r.see.mesh(1).positions;
  r.scene.upsert_mesh(1, quad(1));
  r.scene.remove_mesh(2);
  r.scene.upsert_mesh(3, quad(0));
  r.scene.upsert_instance(9, instance_of(3));
  r.update();
  CHECK(r.see.mesh(1).motion == first);
  CHECK(r.see.mesh(3).motion == 0);
  const std::uint64_t second = r.see.mesh(1).positions;
  r.scene.upsert_mesh(1, quad(2));
  r.update();
  CHECK(r.see.mesh(1).motion == second);
  r.tables.update();  // the frame is the same
  CHECK(r.see.mesh(1).motion == second);
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
  // Two frames ended since it was set: it stands still in the second.
  r.scene.upsert_mesh(1, quad(3));
  r.scene.commit();
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
  CHECK(r.see.positions(1)[2] == 3);
}

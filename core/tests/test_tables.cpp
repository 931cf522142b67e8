// SPDX-License-Identifier: Apache-2.0
// The scene's tables on a device: what an update uploads, what the records say, and what a Tracer then hits.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "shared/material_program.h"
#include "table_rig.h"

namespace {

using namespace hw;
using namespace hw::table_rig;

// What a ray down from z = 10 at (x, y) hits.
Hit trace(Tracer& tracer, float x, float y, std::uint32_t mask = 0xff) {
  Buffer queue(device(), sizeof(QueueHeader) + 4, BufferUse::device, "queue"),
      rays(device(), sizeof(Ray), BufferUse::device, "rays"), hits(device(), sizeof(Hit), BufferUse::device, "hits");
  const struct {
    QueueHeader header;
    std::uint32_t path;
  } one{{1, 1, 1, 1, 1, 1}, 0};
  const Ray ray{vec3(x, y, 10), 0, vec3(0, 0, -1), HW_INFINITY, mask};
  device().write(queue, 0, std::as_bytes(std::span(&one, 1)));
  device().write(rays, 0, std::as_bytes(std::span(&ray, 1)));
  Commands commands(device());
  tracer.closest(commands, {&queue, &rays, &hits, 1});
  commands.flush();
  Hit hit{};
  device().read(hits, 0, std::as_writable_bytes(std::span(&hit, 1)));
  return hit;
}

}  // namespace

TEST_CASE("tables: an update sends what changed and no more") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_mesh(2, quad());
  r.scene.upsert_instance(1, instance_of(1, at(0)));
  r.scene.upsert_instance(2, instance_of(2, at(5)));
  TableCounts counts = r.update();
  CHECK(counts.meshes_uploaded == 2);
  CHECK(counts.instances_uploaded == 2);
  CHECK(r.tables.totals().triangles == 4);
  CHECK(trace(*r.tracer, 0, 0).instance == 0);
  CHECK(trace(*r.tracer, 5, 0).instance == 1);
  CHECK(trace(*r.tracer, 10, 0).instance == HW_NONE);

  counts = r.update();
  CHECK(counts.bytes_uploaded == 0);

  r.scene.upsert_instance(2, instance_of(2, at(10)));
  counts = r.update();
  CHECK(counts.meshes_uploaded == 0);
  CHECK(counts.instances_uploaded == 1);
  CHECK(counts.bytes_uploaded == sizeof(InstanceRecord));
  CHECK(r.see.instance(1).previous_object_to_world[3] == 5);
  CHECK(trace(*r.tracer, 5, 0).instance == HW_NONE);
  CHECK(trace(*r.tracer, 10, 0).instance == 1);
  counts = r.update();  // it stands still: the record says so
  CHECK(counts.instances_uploaded == 1);
  CHECK(r.see.instance(1).previous_object_to_world[3] == 10);

  r.scene.remove_instance(1);
  r.scene.remove_mesh(1);
  r.update();
  CHECK(trace(*r.tracer, 0, 0).instance == HW_NONE);
  CHECK(trace(*r.tracer, 10, 0).instance == 0);
  r.scene.clear();
  r.update();
  CHECK(r.tables.root().instance_count == 0);
  CHECK(trace(*r.tracer, 10, 0).instance == HW_NONE);
}

TEST_CASE("tables: a mesh that deforms keeps last frame's positions for one frame") {
  Rig r;
  r.scene.upsert_mesh(1, quad(0));
  r.scene.upsert_instance(1, instance_of(1));
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
  const std::uint64_t before = r.see.mesh(1).positions;
  r.scene.upsert_mesh(1, quad(2));
  r.update();
  CHECK(r.see.mesh(1).motion == before);
  CHECK(r.see.positions(1)[2] == 2);
  CHECK(trace(*r.tracer, 0, 0).t == doctest::Approx(8));
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
  r.scene.upsert_mesh(1, quad(2));  // sent again, but the same
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
  MeshData other = quad(3);
  other.positions.insert(other.positions.end(), {0, 0, 0});
  r.scene.upsert_mesh(1, other);  // another number of vertices: nothing to compare
  r.update();
  CHECK(r.see.mesh(1).motion == 0);
}

TEST_CASE("tables: corners in order are not stored") {
  Rig r;
  MeshData mesh = quad();
  mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  mesh.tri_corners = {0, 1, 2, 3, 4, 5};
  r.scene.upsert_mesh(1, mesh);
  mesh.tri_corners = {0, 1, 2, 3, 5, 4};
  r.scene.upsert_mesh(2, mesh);
  r.update();
  CHECK(r.see.mesh(1).tri_corners == HW_CORNERS_IN_ORDER);
  CHECK(r.see.mesh(2).tri_corners > HW_CORNERS_IN_ORDER);
  mesh.tri_corners = {0, 1, 2, 3, 4, 5};
  r.scene.upsert_mesh(2, mesh);
  r.update();
  CHECK(r.see.mesh(2).tri_corners == HW_CORNERS_IN_ORDER);
}

TEST_CASE("tables: what can't be hit keeps its place") {
  Rig r;
  MeshData none;
  none.name = "none";
  r.scene.upsert_mesh(1, none);
  r.scene.upsert_mesh(2, quad());
  r.scene.upsert_instance(1, instance_of(1));
  r.scene.upsert_instance(2, instance_of(2, {0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0}));  // a point
  r.scene.upsert_instance(
      3, instance_of(2, {1, 0, 0, 6, 0, 1, 0, 0, 0, 0, 0, 1}));  // flat in z, as a plane's scale may be
  r.scene.upsert_instance(4, instance_of(2, {-1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0}));  // mirrored
  r.update();
  CHECK(trace(*r.tracer, 0, 0).instance == HW_NONE);
  CHECK(trace(*r.tracer, 3, 0).instance == HW_NONE);
  CHECK(trace(*r.tracer, 6, 0).instance == 2);
  CHECK(trace(*r.tracer, 6, 0).t == doctest::Approx(9));
  CHECK(trace(*r.tracer, 9, 0).instance == 3);
  CHECK((r.see.instance(3).flags & HW_INSTANCE_MIRRORED) != 0);
  CHECK((r.see.instance(2).flags & HW_INSTANCE_MIRRORED) == 0);
  for (int i = 0; i < 4; ++i) CHECK(all_finite(r.see.instance(i).world_to_object, 12));
  // The mesh gets triangles: its instance is seen at once.
  r.scene.upsert_mesh(1, quad());
  r.update();
  CHECK(trace(*r.tracer, 0, 0).instance == 0);
  r.scene.upsert_mesh(1, none);
  r.update();
  CHECK(trace(*r.tracer, 0, 0).instance == HW_NONE);
}

TEST_CASE("tables: slots, materials and images") {
  Rig r;
  ImageData image;
  image.width = image.height = 1;
  image.format = HW_TEXEL_R8;
  image.texels = {9};
  r.scene.upsert_image(5, image);
  r.scene.upsert_image(6, image);
  MaterialData textured = default_material();
  // An image look-up into register 4 before the default program's closure; its immediate is word 7.
  const std::uint32_t look_up[4] = {HW_OP_IMAGE | 4u << 8, 0, 0, 1};
  textured.program.insert(textured.program.begin() + 4, look_up, look_up + 4);
  textured.images = {0, 6};
  r.scene.upsert_material(1, textured);
  r.scene.upsert_material(2, material(HW_MATERIAL_TRANSPARENT));
  MeshData mesh = quad();
  mesh.tri_slots = {0, 3};
  r.scene.upsert_mesh(1, mesh);
  r.scene.upsert_instance(1, instance_of(1, at(0), {1, 2}));
  r.scene.upsert_instance(2, instance_of(1, at(5), {1}));
  r.scene.upsert_instance(3, instance_of(1, at(9)));
  r.update();
  CHECK(r.see.images() == 3);
  CHECK(r.see.image(0).width == 0);
  CHECK(r.see.program_word(r.see.material(1).program * 1 + 7) == 2);  // image id 6 is the second in the table
  CHECK((r.tables.totals().classes.all & HW_VM_IMAGE << HW_FEATURE_VM_SHIFT) != 0);
  // Triangles name slot 3: every instance has four, the last material repeated.
  const std::uint32_t expected[3][4] = {{1, 2, 2, 2}, {1, 1, 1, 1}, {0, 0, 0, 0}};
  for (int i = 0; i < 3; ++i) {
    CHECK(r.see.instance(i).slot_count == 4);
    for (int s = 0; s < 4; ++s) CHECK(r.see.slot(r.see.instance(i).slot_offset + s) == expected[i][s]);
  }
  CHECK((r.see.instance(0).mask & HW_MASK_SHADOW_TRANSPARENT) != 0);
  CHECK((r.see.instance(0).mask & HW_MASK_SHADOW_OPAQUE) == 0);
  CHECK((r.see.instance(1).mask & HW_MASK_SHADOW_OPAQUE) != 0);
  CHECK(trace(*r.tracer, 0, 0, HW_MASK_SHADOW_OPAQUE).instance == HW_NONE);
  CHECK(trace(*r.tracer, 5, 0, HW_MASK_SHADOW_OPAQUE).instance == 1);

  // An image before it goes: the operand follows. A material becomes opaque: the mask follows.
  r.scene.remove_image(5);
  r.scene.upsert_material(2, material(0));
  r.update();
  CHECK(r.see.program_word(r.see.material(1).program + 7) == 1);
  CHECK((r.see.instance(0).mask & HW_MASK_SHADOW_OPAQUE) != 0);
  CHECK(r.tables.totals().material_flags == 0);
}

TEST_CASE("tables: lights") {
  Rig r;
  r.scene.upsert_light(1, lamp(HW_LIGHT_SUN, 0));
  r.scene.upsert_light(2, lamp(HW_LIGHT_POINT, 1));
  r.scene.upsert_light(3, lamp(HW_LIGHT_POINT, 2));
  WorldData world;
  world.color = {1, 1, 1};
  r.scene.set_world(world);
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_instance(1, instance_of(1));
  r.scene.upsert_instance(2, instance_of(1, at(5), {1}));
  r.update();
  const Root& root = r.tables.root();
  CHECK(root.lamp_count == 3);
  // A constant world is no light of the table; one with a program is, once its luminance is known.
  CHECK(root.world_light == HW_NONE);
  CHECK(root.light_count == 5);
  CHECK(r.see.instance(1).light_offset == 3);
  r.scene.upsert_material(2, material(0));
  world.material = 2;
  world.importance_width = 4;
  r.scene.set_world(world);
  r.update();
  r.tables.set_world_luminance(std::vector<float>(8, 1.0f), 4, 2);
  r.update();
  CHECK(root.sun_offset == 2);
  CHECK(root.sun_count == 1);
  CHECK(root.world_light == 3);
  CHECK(root.light_count == 6);
  CHECK(r.see.light(2).type == HW_LIGHT_SUN);
  CHECK(r.see.light(4).type == HW_LIGHT_TRIANGLE);
  CHECK(r.see.light(4).instance == 1);
  CHECK(r.see.instance(0).light_offset == HW_NONE);
  CHECK(r.see.instance(1).light_offset == 4);
  CHECK(root.world.total > 0);

  double sum = 0, low = 1, high = 0;
  for (int i = 0; i < 6; ++i) {
    const double p = r.see.alias(i).pdf;
    sum += p, low = std::min(low, p), high = std::max(high, p);
  }
  CHECK(sum == doctest::Approx(1));
  CHECK(high > 2 * low);  // by power
  r.tables.choose_lights("uniform");
  for (int i = 0; i < 6; ++i) CHECK(r.see.alias(i).pdf == doctest::Approx(1.0 / 6));
  CHECK_THROWS_AS(r.tables.choose_lights("magic"), std::invalid_argument);
  r.tables.choose_lights("tree");
  CHECK(r.see.alias(0).pdf != r.see.alias(5).pdf);  // by power beside the tree
  CHECK(r.tables.root().light_tree_nodes == 11);
  r.tables.choose_lights("uniform");
  CHECK(r.tables.root().light_tree_nodes == 0);

  // The emitter moves: its triangles do, the offset stays, no mesh is touched.
  r.scene.upsert_instance(2, instance_of(1, at(7), {1}));
  TableCounts counts = r.update();
  CHECK(counts.meshes_uploaded == 0);
  CHECK(r.see.light(4).position.x == 6);
  CHECK(r.see.instance(1).light_offset == 4);
  // A lamp moves: lights only.
  r.scene.upsert_light(3, lamp(HW_LIGHT_POINT, 4));
  counts = r.update();
  CHECK(r.see.light(1).position.x == 4);
  // It gets another mesh: triangles are counted anew.
  MeshData one = quad();
  one.tri_vertices.resize(3);
  r.scene.upsert_mesh(1, one);
  r.update();
  CHECK(r.tables.root().light_count == 5);
  CHECK(r.see.instance(1).light_offset == 4);
  // It no longer emits.
  r.scene.upsert_material(1, material(0));
  r.update();
  CHECK(r.tables.root().light_count == 4);
  CHECK(r.see.instance(1).light_offset == HW_NONE);
  r.scene.set_world(WorldData{});
  r.scene.remove_light(1);
  r.scene.remove_light(2);
  r.scene.remove_light(3);
  r.update();
  CHECK(r.tables.root().light_count == 0);
  CHECK(r.tables.root().world_light == HW_NONE);
}

TEST_CASE("tables: the world's importance map is asked for when its material changes") {
  Rig r;
  ImageData sky;
  sky.width = 512, sky.height = 256;
  sky.format = HW_TEXEL_R8;
  sky.texels.resize(512 * 256);
  r.scene.upsert_image(1, sky);
  MaterialData background = default_material();
  background.images = {1};
  r.scene.upsert_material(1, background);
  WorldData world;
  world.material = 1;
  r.scene.set_world(world);
  r.update();
  REQUIRE(r.tables.world_luminance_wanted());
  CHECK(r.tables.world_luminance_wanted()->width == 512);
  CHECK(r.tables.world_luminance_wanted()->height == 256);
  CHECK(r.tables.root().world_material == 1);
  CHECK(r.tables.root().world.total == 0);
  const std::vector<float> values(8, 2.0f);
  CHECK_THROWS_AS(r.tables.set_world_luminance(values, 4, 4), std::invalid_argument);
  r.tables.set_world_luminance(values, 4, 2);
  CHECK_FALSE(r.tables.world_luminance_wanted());
  CHECK(r.tables.root().world.width == 4);
  CHECK(r.tables.root().world.total > 0);
  CHECK(r.see.light(0).emission.x == doctest::Approx(2));
  r.update();
  CHECK_FALSE(r.tables.world_luminance_wanted());
  r.scene.upsert_image(1, sky);
  r.update();
  CHECK(r.tables.world_luminance_wanted());
  world.sample = false;
  r.scene.set_world(world);
  r.update();
  CHECK_FALSE(r.tables.world_luminance_wanted());
  CHECK(r.tables.root().world_light == HW_NONE);
  CHECK(r.tables.root().world_material == 1);
}

TEST_CASE("tables: arrays live once, and several tables may show one scene") {
  REQUIRE(device().shared_memory());
  Scene scene;
  scene.upsert_mesh(1, quad());
  ImageData image;
  image.width = image.height = 2;
  image.texels.assign(16, 7);
  scene.upsert_image(1, image);
  scene.upsert_instance(1, instance_of(1, at(0)));
  auto tracer = make_tracer(device(), "embree", 1);
  {
    Tables first(device(), scene, *tracer);
    scene.commit();
    first.update();
    CHECK(scene.impl().meshes.at(1).data.positions.empty());
    CHECK(scene.impl().images.at(1).data.texels.empty());
    CHECK(scene.impl().meshes.at(1).arrays.positions.data() == TablesInspector(first).positions(1));
    {
      // The same scene on another Tracer, and then on this one: the first is put out and comes back.
      auto other = make_tracer(device(), "embree", 1);
      Tables second(device(), scene, *other), third(device(), scene, *tracer);
      second.update();
      CHECK(trace(*other, 0, 0).instance == 0);
      CHECK(first.current());
      third.update();
      CHECK_FALSE(first.current());
      CHECK(trace(*tracer, 0, 0).instance == 0);
      first.update();
      CHECK(first.current());
      CHECK_FALSE(third.current());
      CHECK(trace(*tracer, 0, 0).instance == 0);
    }
    CHECK(trace(*tracer, 0, 0).instance == 0);  // the third went without taking ours along
  }
  CHECK(scene.impl().meshes.at(1).data.positions == quad().positions);
  CHECK(scene.impl().images.at(1).data.texels == image.texels);
  CHECK(scene.impl().meshes.at(1).lender == nullptr);
  CHECK(trace(*tracer, 0, 0).instance == HW_NONE);
}

TEST_CASE("tables: an update that runs out of memory is one error, and the next one works") {
  Rig r;
  r.scene.upsert_mesh(1, quad());
  r.scene.upsert_instance(1, instance_of(1));
  r.scene.upsert_light(1, lamp(HW_LIGHT_POINT, 0));
  MeshData large;
  large.name = "large";
  large.positions.assign(3'000'000, 0.0f);
  large.tri_vertices = {0, 1, 2};
  r.scene.upsert_mesh(2, large);
  device().set_memory_limit(device().bytes_in_use() + 1'000'000);
  CHECK_THROWS_AS(r.update(), OutOfMemory);
  CHECK_FALSE(r.tables.current());
  device().set_memory_limit(0);
  r.update();
  CHECK(r.tables.current());
  CHECK(r.tables.root().lamp_count == 1);
  CHECK(trace(*r.tracer, 0, 0).instance == 0);
}

TEST_CASE("tables: ten thousand instances of a thousand meshes, one moved") {
  Rig r;
  for (Id id = 1; id <= 1000; ++id) r.scene.upsert_mesh(id, quad());
  for (Id id = 1; id <= 10000; ++id) r.scene.upsert_instance(id, instance_of(1 + id % 1000, at(float(id) * 3)));
  r.update();
  r.scene.upsert_instance(77, instance_of(78, at(-50)));
  const TableCounts counts = r.update();
  CHECK(counts.meshes_uploaded == 0);
  CHECK(counts.instances_uploaded == 1);
  CHECK(counts.bytes_uploaded == sizeof(InstanceRecord));
  CHECK(counts.upload_seconds < 0.05);
  CHECK(trace(*r.tracer, -50, 0).instance == 76);
}

// SPDX-License-Identifier: Apache-2.0
// Lights followed over updates of the tables: where each went, and whether some shine brighter or differ at all.
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "table_rig.h"

namespace {

using namespace hw;
using namespace hw::table_rig;
using Places = std::vector<std::uint32_t>;

constexpr std::uint32_t kGone = HW_NONE;

// As `quad`, with `triangles` of them.
MeshData fan(int triangles) {
  MeshData mesh;
  mesh.name = "fan";
  for (int i = 0; i < triangles + 2; ++i)
    mesh.positions.insert(mesh.positions.end(), {float(i), float(i) * float(i), 0.0f});
  for (std::uint32_t i = 0; i < std::uint32_t(triangles); ++i)
    mesh.tri_vertices.insert(mesh.tri_vertices.end(), {0, i + 1, i + 2});
  return mesh;
}

WorldData sky(Id material) {
  WorldData world;
  world.material = material;
  world.importance_width = 4;
  return world;
}

// A lamp (light 0), a sun (1), and two squares that emit (2 to 5), with changes taken.
struct LightRig : Rig {
  LightRig() {
    scene.upsert_light(10, lamp(HW_LIGHT_POINT, 1));
    scene.upsert_light(11, lamp(HW_LIGHT_SUN, 2));
    scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));
    scene.upsert_material(2, material(0));
    scene.upsert_mesh(1, quad());
    scene.upsert_instance(5, instance_of(1, at(0), {1}));
    scene.upsert_instance(7, instance_of(1, at(5), {1}));
    update();
    tables.take_light_changes();
  }
  // Brings the tables in line and says what became of the lights.
  LightChanges sync() {
    update();
    return tables.take_light_changes();
  }
  // `changed` and `brightened`, of a sync that moves nothing to another place.
  std::pair<bool, bool> in_place() {
    const LightChanges changes = sync();
    CHECK(changes.remap.empty());
    return {changes.changed, changes.brightened};
  }
};

constexpr std::pair<bool, bool> kSame{false, false}, kChanged{true, false}, kBrighter{true, true};

}  // namespace

TEST_CASE("light identity: from nothing, all lights are new; taken once, nothing is") {
  Rig r;
  r.update();
  CHECK_FALSE(r.tables.light_changes().changed);
  r.scene.upsert_light(1, lamp(HW_LIGHT_POINT, 0));
  r.update();
  r.update();
  CHECK(r.tables.light_changes().remap.empty());
  CHECK(r.tables.light_changes().brightened);
  CHECK(r.tables.take_light_changes().changed);
  CHECK_FALSE(r.tables.light_changes().changed);
  CHECK_FALSE(r.tables.light_changes().brightened);
  r.update();
  CHECK_FALSE(r.tables.light_changes().changed);
}

TEST_CASE("light identity: lights that come and go") {
  LightRig r;
  CHECK(r.in_place() == kSame);
  // A lamp before the others, by its id: all move up. A sun's place is after it whatever its id.
  r.scene.upsert_light(3, lamp(HW_LIGHT_SUN, 3));
  r.scene.upsert_light(4, lamp(HW_LIGHT_POINT, 4));
  LightChanges c = r.sync();
  CHECK(c.remap == Places{1, 3, 4, 5, 6, 7});
  CHECK(c.brightened);
  CHECK(r.see.light(1).position.x == 1);
  CHECK(r.see.light(3).type == HW_LIGHT_SUN);
  r.scene.remove_light(4);
  c = r.sync();
  CHECK(c.remap == Places{kGone, 0, 1, 2, 3, 4, 5, 6});
  CHECK(c.changed);
  CHECK_FALSE(c.brightened);
  // The last one goes: the others keep their places, but the list says that it is gone.
  r.scene.remove_instance(7);
  c = r.sync();
  CHECK(c.remap == Places{0, 1, 2, 3, 4, kGone, kGone});
  CHECK_FALSE(c.brightened);
  // One comes behind all others.
  r.scene.upsert_instance(8, instance_of(1, at(8), {1}));
  CHECK(r.in_place() == kBrighter);
  // A lamp that becomes another kind is another lamp.
  r.scene.upsert_light(10, lamp(HW_LIGHT_AREA, 1));
  c = r.sync();
  CHECK(c.remap == Places{kGone, 1, 2, 3, 4, 5, 6});
  CHECK(c.brightened);
  // One that is dark comes: nothing is brighter.
  LightData dark = lamp(HW_LIGHT_POINT, 0);
  dark.power = 0;
  r.scene.upsert_light(1, dark);
  c = r.sync();
  CHECK(c.remap == Places{1, 2, 3, 4, 5, 6, 7});
  CHECK(c.changed);
  CHECK_FALSE(c.brightened);
}

TEST_CASE("light identity: a scene that is cleared and filled again") {
  LightRig r;
  r.scene.clear();
  r.update();
  CHECK(r.tables.light_changes().remap == Places(6, kGone));
  CHECK(r.tables.light_changes().changed);
  CHECK_FALSE(r.tables.light_changes().brightened);
  // The same lights under the same ids, before anyone looked: they are the old ones.
  r.scene.upsert_light(10, lamp(HW_LIGHT_POINT, 1));
  r.scene.upsert_material(9, material(HW_MATERIAL_EMISSIVE, 3));
  r.scene.upsert_mesh(4, quad());
  r.scene.upsert_instance(7, instance_of(4, at(5), {9}));
  const LightChanges c = r.sync();
  CHECK(c.remap == Places{0, kGone, kGone, kGone, 1, 2});
  CHECK_FALSE(c.brightened);
  r.scene.clear();
  CHECK(r.sync().remap == Places(3, kGone));
  CHECK(r.in_place() == kSame);
}

TEST_CASE("light identity: several updates between two frames") {
  LightRig r;
  r.scene.upsert_light(3, lamp(HW_LIGHT_POINT, 3));
  r.update();
  r.scene.remove_light(10);
  r.update();
  r.tables.choose_lights("uniform");
  r.scene.upsert_instance(6, instance_of(1, at(9), {1}));
  r.update();
  LightChanges c = r.tables.take_light_changes();
  CHECK(c.remap == Places{kGone, 1, 2, 3, 6, 7});
  CHECK(c.brightened);
  // It comes and goes again: nothing was there, for the one who looks now. So for a lamp that flickers.
  r.scene.upsert_light(1, lamp(HW_LIGHT_POINT, 3));
  LightData bright = lamp(HW_LIGHT_POINT, 3);
  bright.power = 7;
  r.scene.upsert_light(3, bright);
  r.update();
  CHECK(r.tables.light_changes().brightened);
  r.scene.remove_light(1);
  r.scene.upsert_light(3, lamp(HW_LIGHT_POINT, 3));
  CHECK(r.in_place() == kSame);
  r.tables.choose_lights("power");
  CHECK(r.in_place() == kSame);
}

TEST_CASE("light identity: a lamp moves, changes its power, colour and shape") {
  LightRig r;
  LightData data = lamp(HW_LIGHT_POINT, 1);
  const auto set = [&] {
    r.scene.upsert_light(10, data);
    return r.in_place();
  };
  CHECK(set() == kSame);
  data.object_to_world = at(2);
  CHECK(set() == kChanged);
  data.power = 0.5f;
  CHECK(set() == kChanged);
  data.power = 0.6f;
  CHECK(set() == kBrighter);
  data.power = 0;
  CHECK(set() == kChanged);
  data.power = 0.1f;
  CHECK(set() == kBrighter);
  data.color = {1, 0.5f, 0.5f};
  CHECK(set() == kChanged);
  data.color = {0.5f, 0.5f, 1};  // as strong, but bluer
  CHECK(set() == kBrighter);
  data.flags &= ~HW_LIGHT_DIFFUSE;
  CHECK(set() == kChanged);
  data.flags |= HW_LIGHT_DIFFUSE;
  CHECK(set() == kBrighter);
  // A rotated area lamp rounds; a narrower spread shines brighter ahead.
  data.type = HW_LIGHT_AREA;
  r.scene.upsert_light(10, data);
  CHECK(r.sync().remap == Places{kGone, 1, 2, 3, 4, 5});
  const float c = std::cos(1.0f), s = std::sin(1.0f);
  data.object_to_world = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 5};
  CHECK(set() == kChanged);
  data.spread = 1;
  CHECK(set() == kBrighter);
  // The scene grows: a sun's weight in the table with it, but not its light.
  const float before = r.see.alias(1).pdf;
  r.scene.upsert_instance(90, instance_of(1, at(500)));
  CHECK(r.in_place() == kSame);
  CHECK(r.see.alias(1).pdf != doctest::Approx(before));
  LightData sun = lamp(HW_LIGHT_SUN, 2);
  sun.power = 2;
  r.scene.upsert_light(11, sun);
  CHECK(r.in_place() == kBrighter);
}

TEST_CASE("light identity: emissive objects") {
  LightRig r;
  r.scene.upsert_instance(5, instance_of(1, at(1), {1}));
  CHECK(r.in_place() == kChanged);
  CHECK(r.in_place() == kSame);  // it stands still: its record is written, its light is what it was
  r.scene.upsert_instance(5, instance_of(1, {0.5f, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0}, {1}));
  CHECK(r.in_place() == kChanged);
  r.scene.upsert_instance(5, instance_of(1, at(1), {1}));  // larger: more light
  CHECK(r.in_place() == kBrighter);
  // The mesh deforms. To a larger area it emits more; its triangles are what they were.
  r.scene.upsert_mesh(1, quad(1));
  CHECK(r.in_place() == kChanged);
  MeshData wide = quad(1);
  wide.positions[0] = -3;
  r.scene.upsert_mesh(1, wide);
  CHECK(r.in_place() == kBrighter);
  // As many triangles of the same vertices, but other ones.
  wide.tri_vertices = {0, 1, 3, 1, 2, 3};
  r.scene.upsert_mesh(1, wide);
  LightChanges c = r.sync();
  CHECK(c.remap == Places{0, 1, kGone, kGone, kGone, kGone});
  CHECK(c.brightened);
  // Another number of them.
  r.scene.upsert_mesh(1, fan(3));
  c = r.sync();
  CHECK(c.remap == Places{0, 1, kGone, kGone, kGone, kGone});
  // Hidden from all rays: it keeps its place.
  InstanceData hidden = instance_of(1, at(1), {1});
  hidden.visibility = 0;
  r.scene.upsert_instance(5, hidden);
  CHECK(r.in_place() == kChanged);
  r.scene.upsert_instance(5, instance_of(1, at(1), {1}));
  CHECK(r.in_place() == kBrighter);
  // Another material: it emits no more, and again.
  r.scene.upsert_instance(5, instance_of(1, at(1), {2}));
  c = r.sync();
  CHECK(c.remap == Places{0, 1, kGone, kGone, kGone, 2, 3, 4});
  CHECK_FALSE(c.brightened);
  r.scene.upsert_instance(5, instance_of(1, at(1), {1}));
  c = r.sync();
  CHECK(c.remap == Places{0, 1, 5, 6, 7});
  CHECK(c.brightened);
}

TEST_CASE("light identity: emission of materials, slot by slot") {
  LightRig r;
  MeshData mesh = quad();
  mesh.tri_slots = {0, 1};
  r.scene.upsert_mesh(2, mesh);
  r.scene.upsert_material(3, material(HW_MATERIAL_EMISSIVE, 0));
  r.scene.upsert_instance(7, instance_of(2, at(5), {1, 3}));
  r.sync();
  r.scene.upsert_material(2, material(0));
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));  // the same again
  CHECK(r.in_place() == kSame);
  // One slot comes on while another dims by more: something is brighter.
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 1));
  r.scene.upsert_material(3, material(HW_MATERIAL_EMISSIVE, 0.1f));
  CHECK(r.in_place() == kBrighter);
  r.scene.upsert_material(3, material(HW_MATERIAL_EMISSIVE, 0));
  CHECK(r.in_place() == kChanged);
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMIT_FRONT, 1));
  CHECK(r.in_place() == kChanged);
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMIT_BACK, 1));
  CHECK(r.in_place() == kBrighter);
  // Slots exchange their triangles: those are not the lights that they were.
  mesh.tri_slots = {1, 0};
  r.scene.upsert_mesh(2, mesh);
  CHECK(r.sync().remap == Places{0, 1, 2, 3, kGone, kGone});

  // A program may emit anything once it, its image or what it reads of the object is set again.
  ImageData image;
  image.width = image.height = 1;
  image.format = HW_TEXEL_R8;
  image.texels = {9};
  r.scene.upsert_image(1, image);
  MaterialData screen = material(HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMISSION_SHADER, 1);
  screen.images = {1};
  r.scene.upsert_material(3, screen);
  CHECK(r.in_place() == kBrighter);
  r.scene.upsert_image(1, image);
  CHECK(r.in_place() == kBrighter);
  r.scene.upsert_material(3, screen);
  CHECK(r.in_place() == kBrighter);
  InstanceData thing = instance_of(2, at(6), {1, 3});
  r.scene.upsert_instance(7, thing);
  CHECK(r.in_place() == kChanged);
  thing.color = {1, 0, 0};
  r.scene.upsert_instance(7, thing);
  CHECK(r.in_place() == kBrighter);
  // ... but not one that emits a constant.
  InstanceData plain = instance_of(1, at(0), {1});
  plain.color = {1, 0, 0};
  r.scene.upsert_instance(5, plain);
  CHECK(r.in_place() == kSame);
}

TEST_CASE("light identity: the world") {
  LightRig r;
  // A constant world is not in the table, but it is a light.
  WorldData world;
  world.color = {1, 1, 1};
  r.scene.set_world(world);
  CHECK(r.in_place() == kBrighter);
  r.scene.set_world(world);
  CHECK(r.in_place() == kSame);
  world.color = {1, 1, 0.5f};
  r.scene.set_world(world);
  CHECK(r.in_place() == kChanged);
  // One with a program takes a place after the suns. What its luminance turns out to be is no change of it.
  r.scene.set_world(sky(2));
  LightChanges c = r.sync();
  CHECK(c.remap == Places{0, 1, 3, 4, 5, 6});
  CHECK(c.brightened);
  r.tables.set_world_luminance(std::vector<float>(8, 5.0f), 4, 2);
  CHECK(r.in_place() == kSame);
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));
  CHECK(r.in_place() == kSame);
  r.scene.upsert_material(2, material(0));
  CHECK(r.in_place() == kBrighter);
  r.scene.set_world(WorldData{});
  c = r.sync();
  CHECK(c.remap == Places{0, 1, kGone, 2, 3, 4, 5});
  CHECK(c.changed);
  CHECK_FALSE(c.brightened);
}

TEST_CASE("light identity: instances made in groups, cut and joined") {
  LightRig r;
  r.scene.remove_instances(5, 1);
  r.scene.remove_instances(7, 1);
  std::vector<Matrix34> rows;
  for (int i = 0; i < 10; ++i) rows.push_back(at(float(i)));
  const auto group = [&](Id first, std::size_t count) {
    r.scene.upsert_instances(first, instance_of(1, at(0), {1}), rows[first - 100].data(), nullptr, count);
  };
  group(100, 10);
  r.sync();
  // Instance 103 goes, 107 to 109 become a group of their own.
  r.scene.remove_instance(103);
  group(107, 3);
  LightChanges c = r.sync();
  Places expected;
  for (std::uint32_t i = 0; i < 22; ++i) expected.push_back(i < 8 ? i : i < 10 ? kGone : i - 2);
  CHECK(c.remap == expected);
  CHECK_FALSE(c.brightened);
  // All of them as one group again.
  group(100, 10);
  c = r.sync();
  CHECK(c.brightened);  // 103 is new
  REQUIRE(c.remap.size() == 20);
  for (std::uint32_t i = 0; i < 20; ++i) CHECK(c.remap[i] == (i < 8 ? i : i + 2));
  // One of many grows.
  rows[4] = {2, 0, 0, 4, 0, 1, 0, 0, 0, 0, 1, 0};
  group(100, 10);
  CHECK(r.in_place() == kBrighter);
}

TEST_CASE("light identity: a refused update loses nothing") {
  LightRig r;
  r.scene.upsert_light(1, lamp(HW_LIGHT_POINT, 0));
  MeshData large;
  large.name = "large";
  large.positions.assign(3'000'000, 0.0f);
  large.tri_vertices = {0, 1, 2};
  r.scene.upsert_mesh(2, large);
  device().set_memory_limit(device().bytes_in_use() + 1'000'000);
  CHECK_THROWS_AS(r.update(), OutOfMemory);
  device().set_memory_limit(0);
  CHECK(r.sync().remap == Places{1, 2, 3, 4, 5, 6});
}

// Random edits, with every light known by what its own record says: a lamp by where it stands (they don't move here), a
// triangle by its instance's key, its index and the mesh's triangle count.
TEST_CASE("light identity: random edits against records") {
  using Name = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;
  Rig r;
  std::mt19937 random(3);
  const auto pick = [&](std::uint32_t n) { return std::uint32_t(random() % n); };
  const auto names = [&] {
    std::map<Name, std::uint32_t> places;
    const std::size_t count = r.tables.totals().lights;
    for (std::uint32_t i = 0; i < count; ++i) {
      const LightRecord& l = r.see.light(i);
      Name name{l.type, std::uint32_t(l.position.x), 0, 0};
      if (l.type == HW_LIGHT_WORLD) name = {l.type, 0, 0, 0};
      if (l.type == HW_LIGHT_TRIANGLE) {
        std::uint32_t triangles = 0;
        for (Id mesh = 1; mesh <= 3; ++mesh)
          if (&r.see.mesh(mesh) == &r.see.mesh_at(r.see.instance(l.instance).mesh))
            triangles = r.see.mesh(mesh).triangle_count;
        name = {l.type, r.see.instance(l.instance).key, l.primitive, triangles};
      }
      CHECK(places.emplace(name, i).second);
    }
    return places;
  };
  r.scene.upsert_material(1, material(HW_MATERIAL_EMISSIVE, 3));
  r.scene.upsert_material(2, material(0));
  for (Id mesh = 1; mesh <= 3; ++mesh) r.scene.upsert_mesh(mesh, fan(int(mesh)));
  std::set<Id> lamps, instances;
  std::map<Name, std::uint32_t> before;
  int remapped = 0;
  for (int step = 0; step < 200; ++step) {
    for (int edit = 0; edit < 3; ++edit) {
      const Id id = 1 + pick(12);
      switch (pick(6)) {
        case 0:
          if (lamps.erase(id)) r.scene.remove_light(id);
          break;
        case 1:
          r.scene.upsert_light(id, lamp(pick(3) == 0 ? HW_LIGHT_SUN : HW_LIGHT_POINT, float(id)));
          lamps.insert(id);
          break;
        case 2:
          if (instances.erase(id)) r.scene.remove_instance(id);
          break;
        case 3: {
          const std::size_t count = 1 + pick(3);
          const std::vector<Matrix34> rows(count, at(float(pick(9))));
          r.scene.upsert_instances(id, instance_of(1 + pick(3), at(0), {Id(1 + pick(2))}), rows[0].data(), nullptr,
                                   count);
          for (std::size_t i = 0; i < count; ++i) instances.insert(id + i);
          break;
        }
        case 4:
          r.scene.upsert_mesh(1 + pick(3), fan(1 + int(pick(4))));
          break;
        case 5:
          r.scene.set_world(pick(2) ? sky(2) : WorldData{});
          break;
      }
    }
    if (pick(8) == 0) r.tables.choose_lights(pick(2) ? "uniform" : "power");
    r.update();
    if (pick(2) == 0) continue;
    const LightChanges changes = r.tables.take_light_changes();
    const std::map<Name, std::uint32_t> now = names();
    std::size_t kept = 0;
    for (const auto& [name, place] : before) {
      const auto found = now.find(name);
      const std::uint32_t expected = found == now.end() ? kGone : found->second;
      CHECK((changes.remap.empty() ? place : changes.remap.at(place)) == expected);
      kept += expected != kGone;
    }
    CHECK((changes.remap.empty() || changes.remap.size() == before.size()));
    remapped += !changes.remap.empty();
    if (kept < now.size()) CHECK(changes.brightened);
    if (kept < before.size()) CHECK(changes.changed);
    before = now;
  }
  CHECK(remapped > 50);
}

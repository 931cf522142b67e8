// SPDX-License-Identifier: Apache-2.0
// headwater._core.Scene: edits under stable ids. Arrays are copied here once, or lent; everything else is checked by
// the scene.
#include "scene/scene.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/gil.h"
#include "python/pixels.h"
#include "scene/validate.h"

namespace hw::python {

using namespace nb::literals;

namespace {

using Color = std::array<float, 3>;

std::uint32_t take_domain(nb::handle value, const std::string& what) {
  if (nb::isinstance<nb::int_>(value)) return nb::cast<std::uint32_t>(value);
  const std::string name = nb::isinstance<nb::str>(value) ? nb::cast<std::string>(value) : std::string();
  if (name == "vertex") return HW_DOMAIN_VERTEX;
  if (name == "corner") return HW_DOMAIN_CORNER;
  if (name == "face") return HW_DOMAIN_FACE;
  throw nb::value_error((what + ": the domain must be \"vertex\", \"corner\" or \"face\"").c_str());
}

// An array whose type and shape were looked at; none where None was given.
template <class T>
struct Given {
  AnyArray from;
  std::span<const T> view() const {
    return from.is_valid() ? std::span(static_cast<const T*>(from.data()), from.size()) : std::span<const T>();
  }
};

template <class T>
Given<T> look(nb::handle value, std::initializer_list<std::int64_t> shape, const std::string& what) {
  if (value.is_none()) return {};
  return {take<T>(value, shape, what)};
}

// An attribute without its values, and the array they are in.
AttributeData take_attribute(nb::handle value, const std::string& label, AnyArray& values) {
  nb::tuple entry;
  if (!nb::try_cast<nb::tuple>(value, entry) || entry.size() != 3 || !nb::isinstance<nb::str>(entry[0]))
    throw nb::type_error((label + ": attributes must be a list of (name, domain, array)").c_str());
  AttributeData attribute;
  attribute.name = nb::cast<std::string>(entry[0]);
  const std::string what = label + ": attribute \"" + attribute.name + "\"";
  attribute.domain = take_domain(entry[1], what);
  if (any_array(entry[2], what).ndim() == 1) {
    attribute.components = 1;
    values = take<float>(entry[2], {kAny}, what);
  } else {
    values = take<float>(entry[2], {kAny, kAny}, what);
    if (values.shape(1) < 1 || values.shape(1) > 4)
      throw nb::value_error((what + " must have shape (N,) or (N, 1 to 4), not " + shape_text(values)).c_str());
    attribute.components = static_cast<std::uint32_t>(values.shape(1));
  }
  return attribute;
}

// From this size on, a mesh is copied and checked without the GIL. For smaller ones it is kept: getting it back from a
// thread that runs Python takes up to 5 ms (sys.getswitchinterval()), in which 10 MiB are copied.
constexpr std::size_t kBytesWithoutGil = std::size_t{4} << 20;

void upsert_mesh(Scene& scene, Id id, const std::string& name, nb::object positions, nb::object tri_vertices,
                 nb::object tri_corners, nb::object normals, nb::object tri_slots, nb::object attributes,
                 const std::vector<std::tuple<std::string, std::size_t>>& tangents, int default_uv, bool lend) {
  const std::string label = scene_label("mesh", name, id);
  MeshData mesh;
  mesh.name = name;
  mesh.default_uv = default_uv;
  for (const auto& [tangents_name, uv] : tangents) mesh.tangents.push_back({tangents_name, uv});
  // Every array's type and shape is looked at before the first is copied.
  take<float>(positions, {kAny, 3}, label + ": positions");
  take<std::uint32_t>(tri_vertices, {kAny, 3}, label + ": tri_vertices");
  const Given<float> points = look<float>(positions, {kAny, 3}, label + ": positions");
  const Given<float> directions = look<float>(normals, {kAny, 3}, label + ": normals");
  const Given<std::uint32_t> vertices = look<std::uint32_t>(tri_vertices, {kAny, 3}, label + ": tri_vertices");
  const Given<std::uint32_t> corners = look<std::uint32_t>(tri_corners, {kAny, 3}, label + ": tri_corners");
  const Given<std::uint8_t> slots = look<std::uint8_t>(tri_slots, {kAny}, label + ": tri_slots");
  std::vector<Given<float>> values;
  if (!attributes.is_none())
    for (nb::handle attribute : attributes)
      mesh.attributes.push_back(take_attribute(attribute, label, values.emplace_back().from));
  MeshArrays arrays{points.view(), directions.view(), vertices.view(), corners.view(), slots.view(), {}};
  std::size_t bytes = arrays.positions.size_bytes() + arrays.normals.size_bytes() + arrays.tri_vertices.size_bytes() +
                      arrays.tri_corners.size_bytes() + arrays.tri_slots.size_bytes();
  for (const Given<float>& value : values) bytes += arrays.attributes.emplace_back(value.view()).size_bytes();
  if (lend) {
    mesh.lent = std::move(arrays);
    std::vector<AnyArray> kept{points.from, directions.from, vertices.from, corners.from, slots.from};
    for (const Given<float>& value : values) kept.push_back(value.from);
    mesh.keeper = keeper_of(std::move(kept));
  }
  std::optional<WithoutGil> released;
  if (bytes >= kBytesWithoutGil) released.emplace();
  if (!lend) {
    const auto copy = [](auto& to, const auto& from) { to.assign(from.begin(), from.end()); };
    copy(mesh.positions, arrays.positions), copy(mesh.normals, arrays.normals);
    copy(mesh.tri_vertices, arrays.tri_vertices), copy(mesh.tri_corners, arrays.tri_corners);
    copy(mesh.tri_slots, arrays.tri_slots);
    for (std::size_t i = 0; i < values.size(); ++i) copy(mesh.attributes[i].data, arrays.attributes[i]);
  }
  scene.upsert_mesh(id, std::move(mesh));
}

InstanceData instance_data(Id mesh, const std::string& name, std::vector<Id> materials,
                           std::optional<std::uint32_t> visibility, std::uint32_t object_index, std::uint32_t random_id,
                           std::uint32_t flags, Color color, float shadow_terminator_offset, bool moves) {
  InstanceData data;
  data.name = name;
  data.mesh = mesh;
  data.materials = std::move(materials);
  if (visibility) data.visibility = *visibility;
  data.object_index = object_index;
  data.random_id = random_id;
  data.flags = flags;
  data.color = color;
  data.shadow_terminator_offset = shadow_terminator_offset;
  data.moves = moves;
  return data;
}

void upsert_material(Scene& scene, Id id, const std::string& name, nb::object program, nb::object constants,
                     std::vector<Id> images, std::uint32_t flags, Color emission, std::uint32_t pass_index) {
  const std::string label = scene_label("material", name, id);
  MaterialData material;
  material.name = name;
  material.program = copy<std::uint32_t>(program, {kAny}, label + ": program");
  material.constants = copy<float>(constants, {kAny, 4}, label + ": constants");
  material.images = std::move(images);
  material.flags = flags;
  material.emission = emission;
  material.pass_index = pass_index;
  scene.upsert_material(id, std::move(material));
}

void set_world(Scene& scene, const std::string& name, Color color, Id material, std::uint32_t importance_width,
               bool sample, std::optional<std::uint32_t> flags) {
  WorldData world;
  world.name = name;
  world.color = color;
  world.material = material;
  world.importance_width = importance_width;
  world.sample = sample;
  if (flags) world.flags = *flags;
  scene.set_world(std::move(world));
}

constexpr float kPi = std::numbers::pi_v<float>;

// By HW_PANORAMA_*.
constexpr std::string_view kPanoramas[] = {"equirectangular", "fisheye_equidistant", "fisheye_equisolid", "mirror_ball",
                                           "cube_face",       "cylindrical",         "fisheye_polynomial"};

void set_camera(Scene& scene, const std::string& kind, nb::object matrix, std::tuple<float, float, float, float> plane,
                std::tuple<float, float> clip, float aperture_radius, float focus_distance, std::uint32_t blades,
                float rotation, float ratio, const std::string& panorama, std::tuple<float, float, float, float> range,
                std::tuple<float, float, float, float> lens) {
  CameraData camera{};
  if (kind == "perspective")
    camera.type = HW_CAMERA_PERSPECTIVE;
  else if (kind == "orthographic")
    camera.type = HW_CAMERA_ORTHOGRAPHIC;
  else if (kind == "panoramic")
    camera.type = HW_CAMERA_PANORAMIC;
  else
    throw SceneError("camera: unknown kind \"" + kind + "\" (known: perspective, orthographic, panoramic)");
  const Matrix34 to_world = take_matrix(matrix, "camera: matrix");
  std::copy(to_world.begin(), to_world.end(), camera.camera_to_world);
  std::tie(camera.left, camera.right, camera.bottom, camera.top) = plane;
  std::tie(camera.clip_start, camera.clip_end) = clip;
  camera.aperture_radius = aperture_radius;
  camera.focus_distance = focus_distance;
  camera.aperture_blades = blades;
  camera.aperture_rotation = rotation;
  camera.aperture_ratio = ratio;
  const auto* known = std::find(std::begin(kPanoramas), std::end(kPanoramas), panorama);
  if (known == std::end(kPanoramas)) throw SceneError("camera: unknown panorama \"" + panorama + "\"");
  camera.panorama = static_cast<std::uint32_t>(known - std::begin(kPanoramas));
  float* r = camera.panorama_range;
  std::tie(r[0], r[1], r[2], r[3]) = range;
  float* k = camera.panorama_lens;
  std::tie(k[0], k[1], k[2], k[3]) = lens;
  scene.set_camera(camera);
}

void bind_geometry(nb::class_<Scene>& scene) {
  scene
      .def(
          "upsert_mesh", &upsert_mesh, "id"_a, "name"_a, "positions"_a, "tri_vertices"_a, nb::kw_only(),
          "tri_corners"_a = nb::none(), "normals"_a = nb::none(), "tri_slots"_a = nb::none(),
          "attributes"_a = nb::none(), "tangents"_a = std::vector<std::tuple<std::string, std::size_t>>(),
          "default_uv"_a = -1, "lend"_a = false,
          "Sets a mesh, in object space.\n\n"
          "positions: (V, 3) float32, metres; NaN and infinity are refused.\n"
          "tri_vertices: (T, 3) uint32 into positions; T may be 0.\n"
          "tri_corners: (T, 3) uint32 into normals and corner attributes; None: as tri_vertices.\n"
          "normals: (C, 3) float32, unit, one a corner; None: flat. One that is not finite or is zero becomes the\n"
          "    geometric normal of its triangle.\n"
          "tri_slots: (T,) uint8, material slot of each triangle; None: slot 0.\n"
          "attributes: [(name, \"vertex\" | \"corner\" | \"face\", (N,) or (N, 1..4) float32)], at most 8; N is V, C "
          "or T.\n"
          "    Values that are not finite become 0.\n"
          "tangents: [(name, index of a UV map among attributes)], each one more attribute: of corners, (C, 4), unit\n"
          "    vectors along u in object space and the sign of the bitangent, as MikkTSpace averages them. Made at the "
          "next\n"
          "    sync. Without tri_corners a vertex has those of its last triangle.\n"
          "default_uv: index of the UV map among attributes, -1: none.\n"
          "lend: the arrays are not copied: nobody may write to them afterwards. The scene lets go of them when the "
          "mesh is\n"
          "    on a device that shares the host's memory, or is set or removed.")
      .def("keep_lent", &Scene::keep_lent,
           "Copies the arrays that meshes were lent and that are not on a device yet: they may then be written to and "
           "freed.")
      .def("remove_mesh", &Scene::remove_mesh, "id"_a, "Removes a mesh. SceneError while an instance uses it.")
      .def("has_mesh", &Scene::has_mesh, "id"_a, "Whether there is a mesh of this id.")
      .def(
          "upsert_instance",
          [](Scene& self, Id id, Id mesh, nb::object matrix, const std::string& name, std::vector<Id> materials,
             std::optional<std::uint32_t> visibility, std::uint32_t object_index, std::uint32_t random_id,
             std::uint32_t flags, Color color, float shadow_terminator_offset, bool moves) {
            InstanceData data = instance_data(mesh, name, std::move(materials), visibility, object_index, random_id,
                                              flags, color, shadow_terminator_offset, moves);
            data.object_to_world = take_matrix(matrix, scene_label("instance", name, id) + ": matrix");
            self.upsert_instance(id, std::move(data));
          },
          "id"_a, "mesh"_a, "matrix"_a, nb::kw_only(), "name"_a = "", "materials"_a = std::vector<Id>(),
          "visibility"_a = nb::none(), "object_index"_a = 0, "random_id"_a = 0, "flags"_a = 0,
          "color"_a = Color{1, 1, 1}, "shadow_terminator_offset"_a = 0.1f, "moves"_a = false,
          "Sets an instance of a mesh.\n\n"
          "matrix: (3, 4) float32 or float64, object to world. One without volume is allowed: an object flattened "
          "along one\n"
          "    axis is seen as a sheet, one flattened along more is not seen.\n"
          "materials: ids by slot, 0: the default material; slots past the end take the last.\n"
          "visibility: HW_MASK_* bits. flags: HW_INSTANCE_*. object_index: for the Object Index pass.\n"
          "random_id: 32-bit hash for Object Info > Random. color: the object's colour.\n"
          "moves: a hint that it moves between frames. Its last frame's place is kept for motion vectors.")
      .def(
          "upsert_instances",
          [](Scene& self, Id first_id, Id mesh, nb::object matrices, nb::object random_ids, const std::string& name,
             std::vector<Id> materials, std::optional<std::uint32_t> visibility, std::uint32_t object_index,
             std::uint32_t random_id, std::uint32_t flags, Color color, float shadow_terminator_offset, bool moves) {
            const std::string label = scene_label("instance", name, first_id);
            const AnyArray rows = take<float>(matrices, {kAny, 3, 4}, label + ": matrices");
            const std::size_t count = rows.shape(0);
            const std::uint32_t* random = nullptr;
            AnyArray random_rows;
            if (!random_ids.is_none()) {
              random_rows = take<std::uint32_t>(random_ids, {static_cast<std::int64_t>(count)}, label + ": random_ids");
              random = static_cast<const std::uint32_t*>(random_rows.data());
            }
            self.upsert_instances(first_id,
                                  instance_data(mesh, name, std::move(materials), visibility, object_index, random_id,
                                                flags, color, shadow_terminator_offset, moves),
                                  static_cast<const float*>(rows.data()), random, count);
          },
          "first_id"_a, "mesh"_a, "matrices"_a, nb::kw_only(), "random_ids"_a = nb::none(), "name"_a = "",
          "materials"_a = std::vector<Id>(), "visibility"_a = nb::none(), "object_index"_a = 0, "random_id"_a = 0,
          "flags"_a = 0, "color"_a = Color{1, 1, 1}, "shadow_terminator_offset"_a = 0.1f, "moves"_a = false,
          "Sets instances first_id, first_id + 1, ... of one mesh, alike but for matrix and random number.\n\n"
          "matrices: (N, 3, 4) float32. random_ids: (N,) uint32, None: random_id for all. The rest as upsert_instance.")
      .def("remove_instance", &Scene::remove_instance, "id"_a, "Removes one instance.")
      .def("remove_instances", &Scene::remove_instances, "first_id"_a, "count"_a,
           "Removes instances first_id, first_id + 1, ...; SceneError when one of them does not exist.");
}

void bind_shading(nb::class_<Scene>& scene) {
  scene
      .def("upsert_material", &upsert_material, "id"_a, "name"_a, "program"_a, "constants"_a,
           "images"_a = std::vector<Id>(), "flags"_a = 0, "emission"_a = Color{0, 0, 0}, "pass_index"_a = 0,
           "Sets a material. SceneError when the program is malformed.\n\n"
           "id: above 0. program: (W,) uint32, constants: (K, 4) float32, as shaders/shared/material_program.h "
           "describes.\n"
           "images: ids that the program's image operands index, 0: a missing image. flags: HW_MATERIAL_*.\n"
           "emission: radiance when it is constant, else an estimate of it, for choosing lights.\n"
           "pass_index: for the Material Index pass.")
      .def("remove_material", &Scene::remove_material, "id"_a,
           "Removes a material. SceneError while an instance or the world uses it.")
      .def(
          "upsert_image",
          [](Scene& self, Id id, const std::string& name, nb::object pixels, bool srgb, bool premultiplied, bool lend) {
            ImageData image = take_image(pixels, scene_label("image", name, id), lend);
            image.name = name;
            image.flags = (srgb ? HW_IMAGE_SRGB : 0u) | (premultiplied ? HW_IMAGE_PREMULTIPLIED : 0u);
            self.upsert_image(id, std::move(image));
          },
          "id"_a, "name"_a, "pixels"_a.none(), nb::kw_only(), "srgb"_a = false, "premultiplied"_a = false,
          "lend"_a = false,
          "Sets an image.\n\n"
          "id: above 0. pixels: (H, W), (H, W, 1), (H, W, 3) or (H, W, 4), bottom row first; uint8 (0..255 is 0..1), "
          "float16\n"
          "    or float32; None: a missing image, which reads as magenta. One and three channels get alpha 1.\n"
          "srgb: colours are sRGB-encoded. premultiplied: colours are already multiplied by alpha. lend: as in "
          "upsert_mesh.")
      .def("remove_image", &Scene::remove_image, "id"_a, "Removes an image. SceneError while a material uses it.")
      .def("set_world", &set_world, "name"_a = "", "color"_a = Color{0, 0, 0}, "material"_a = 0,
           "importance_width"_a = 0, "sample"_a = true, "flags"_a = nb::none(),
           "Sets the world.\n\n"
           "color: constant radiance, when material is 0. material: id of one whose program ends in a background.\n"
           "importance_width: resolution of its importance map, 0: by its images. sample: sample it as a light.\n"
           "flags: HW_LIGHT_* bits, which rays see it.")
      .def(
          "set_camera", &set_camera, "kind"_a, "matrix"_a, "plane"_a, nb::kw_only(),
          "clip"_a = std::make_tuple(0.1f, 1000.0f), "aperture_radius"_a = 0.0f, "focus_distance"_a = 10.0f,
          "blades"_a = 0, "rotation"_a = 0.0f, "ratio"_a = 1.0f, "panorama"_a = "equirectangular",
          "range"_a = std::make_tuple(-kPi, kPi, -0.5f * kPi, 0.5f * kPi), "lens"_a = std::make_tuple(0, 0, 0, 0),
          "Sets the camera.\n\n"
          "kind: \"perspective\", \"orthographic\" or \"panoramic\". matrix: (3, 4), it looks along its -Z, Y is up.\n"
          "plane: (left, right, bottom, top) of the full frame, in camera space at distance 1 (perspective) or in "
          "metres\n"
          "    (orthographic) or as a part of the whole panorama, which is (0, 1, 0, 1). clip: (start, end), metres "
          "along "
          "the\n"
          "    viewing direction.\n"
          "aperture_radius: metres, 0: everything in focus. focus_distance: metres. blades: below 3: round.\n"
          "rotation: radians. ratio: of the aperture, 1: round.\n"
          "panorama: \"equirectangular\", range: longitude from, to, latitude from, to, radians;\n"
          "    \"fisheye_equidistant\": field of view, radians; \"fisheye_equisolid\": focal length, field of view, "
          "width and\n"
          "    height of the sensor; \"mirror_ball\"; \"cube_face\" (equiangular); \"cylindrical\": longitude from, "
          "to, "
          "height\n"
          "    from, to over the radius; \"fisheye_polynomial\": field of view, constant term, width and height of the "
          "sensor,\n"
          "    and lens: coefficients of the distance from its middle, of its square, cube and fourth power. What a "
          "kind does\n"
          "    not say is not looked at.");
}

}  // namespace

void bind_scene(nb::module_& m) {
  nb::class_<Scene> scene(
      m, "Scene",
      "Scene data under ids that the caller chooses. An edit takes effect whole or raises SceneError (or TypeError "
      "for\n"
      "an argument of the wrong type) and changes nothing. Not for use from several threads at once.");
  scene.def(nb::init<>());
  bind_geometry(scene);
  bind_lights(scene);
  bind_shading(scene);
  scene.def("clear", &Scene::clear, "Removes everything.");
}

}  // namespace hw::python

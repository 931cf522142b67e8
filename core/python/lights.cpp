// SPDX-License-Identifier: Apache-2.0
// The lamps of headwater._core.Scene: one at a time, or any number that differ only in their place.
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "python/arrays.h"
#include "python/bind.h"
#include "scene/scene.h"
#include "scene/validate.h"

namespace hw::python {

using namespace nb::literals;

namespace {

using Color = std::array<float, 3>;

LightData light_data(const std::string& label, const std::string& name, const std::string& kind, Color color,
                     float power, std::optional<std::uint32_t> flags, bool normalize, float radius, float angle,
                     float size_x, float size_y, bool ellipse, float spread, float spot_size, float spot_blend) {
  LightData light;
  light.name = name;
  if (kind == "point")
    light.type = HW_LIGHT_POINT;
  else if (kind == "spot")
    light.type = HW_LIGHT_SPOT;
  else if (kind == "sun")
    light.type = HW_LIGHT_SUN;
  else if (kind == "area")
    light.type = HW_LIGHT_AREA;
  else
    throw SceneError(label + ": unknown kind \"" + kind + "\" (known: point, spot, sun, area)");
  if (flags) light.flags = *flags;
  light.color = color, light.power = power, light.normalize = normalize;
  light.radius = radius, light.angle = angle;
  light.size_x = size_x, light.size_y = size_y, light.ellipse = ellipse, light.spread = spread;
  light.spot_size = spot_size, light.spot_blend = spot_blend;
  return light;
}

// The array's elements, which are there while `from` lives.
std::span<const Id> take_ids(nb::handle value, const std::string& what, AnyArray& from) {
  from = take<Id>(value, {kAny}, what);
  return {static_cast<const Id*>(from.data()), from.size()};
}

}  // namespace

void bind_lights(nb::class_<Scene>& scene) {
  const LightData light;
  scene
      .def(
          "upsert_light",
          [](Scene& self, Id id, const std::string& name, const std::string& kind, nb::object matrix, Color color,
             float power, std::optional<std::uint32_t> flags, bool normalize, float radius, float angle, float size_x,
             float size_y, bool ellipse, float spread, float spot_size, float spot_blend) {
            const std::string label = scene_label("light", name, id);
            LightData lamp = light_data(label, name, kind, color, power, flags, normalize, radius, angle, size_x,
                                        size_y, ellipse, spread, spot_size, spot_blend);
            lamp.object_to_world = take_matrix(matrix, label + ": matrix");
            self.upsert_light(id, std::move(lamp));
          },
          "id"_a, "name"_a, "kind"_a, "matrix"_a, nb::kw_only(), "color"_a = light.color, "power"_a = light.power,
          "flags"_a = nb::none(), "normalize"_a = light.normalize, "radius"_a = light.radius, "angle"_a = light.angle,
          "size_x"_a = light.size_x, "size_y"_a = light.size_y, "ellipse"_a = light.ellipse, "spread"_a = light.spread,
          "spot_size"_a = light.spot_size, "spot_blend"_a = light.spot_blend,
          "Sets a lamp; units and conventions are Blender's.\n\n"
          "kind: \"point\", \"spot\", \"sun\" or \"area\". matrix: (3, 4), it shines along its -Z.\n"
          "color: linear, times the strength of its nodes. power: W, for a sun W/m^2.\n"
          "flags: HW_LIGHT_* bits. normalize: power does not grow with size.\n"
          "radius: metres (point, spot). angle: full angle, radians (sun). size_x, size_y: metres; ellipse; spread: "
          "full\n"
          "angle, radians (area). spot_size: full cone angle, radians; spot_blend: 0 to 1 (spot).")
      .def(
          "upsert_lights",
          [](Scene& self, nb::object ids, const std::string& name, const std::string& kind, nb::object matrices,
             Color color, float power, std::optional<std::uint32_t> flags, bool normalize, float radius, float angle,
             float size_x, float size_y, bool ellipse, float spread, float spot_size, float spot_blend) {
            AnyArray numbers;
            const std::span<const Id> lamps = take_ids(ids, "lights \"" + name + "\": ids", numbers);
            const std::string label = scene_label("light", name, lamps.empty() ? 0 : lamps.front());
            const AnyArray rows =
                take<float>(matrices, {static_cast<std::int64_t>(lamps.size()), 3, 4}, label + ": matrices");
            self.upsert_lights(lamps,
                               light_data(label, name, kind, color, power, flags, normalize, radius, angle, size_x,
                                          size_y, ellipse, spread, spot_size, spot_blend),
                               static_cast<const float*>(rows.data()));
          },
          "ids"_a, "name"_a, "kind"_a, "matrices"_a, nb::kw_only(), "color"_a = light.color, "power"_a = light.power,
          "flags"_a = nb::none(), "normalize"_a = light.normalize, "radius"_a = light.radius, "angle"_a = light.angle,
          "size_x"_a = light.size_x, "size_y"_a = light.size_y, "ellipse"_a = light.ellipse, "spread"_a = light.spread,
          "spot_size"_a = light.spot_size, "spot_blend"_a = light.spot_blend,
          "Sets lamps that are alike but for their place.\n\n"
          "ids: (N,) uint64, quickest in rising order. matrices: (N, 3, 4) float32. The rest as upsert_light.")
      .def("remove_light", &Scene::remove_light, "id"_a, "Removes a lamp.")
      .def(
          "remove_lights",
          [](Scene& self, nb::object ids) {
            AnyArray numbers;
            self.remove_lights(take_ids(ids, "lights: ids", numbers));
          },
          "ids"_a, "Removes lamps. ids: (N,) uint64; SceneError when one of them does not exist.");
}

}  // namespace hw::python

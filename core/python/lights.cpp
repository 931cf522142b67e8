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

void upsert_light(Scene& scene, Id id, const std::string& name, nb::handle matrix, auto&& make) {
  const std::string label = scene_label("light", name, id);
  LightData lamp = make(label);
  lamp.object_to_world = take_matrix(matrix, label + ": matrix");
  scene.upsert_light(id, std::move(lamp));
}

void upsert_lights(Scene& scene, nb::handle ids, const std::string& name, nb::handle matrices, auto&& make) {
  AnyArray numbers;
  const std::span<const Id> lamps = take_ids(ids, "lights \"" + name + "\": ids", numbers);
  const std::string label = scene_label("light", name, lamps.empty() ? 0 : lamps.front());
  const AnyArray rows = take<float>(matrices, {static_cast<std::int64_t>(lamps.size()), 3, 4}, label + ": matrices");
  scene.upsert_lights(lamps, make(label), static_cast<const float*>(rows.data()));
}

// A method that sets lamps: what and where they are by position, then the settings of lamps by keyword.
// upsert(scene, which, name, where, make): make(label) is the LightData, but for its place.
template <class Which>
void bind_upsert(nb::class_<Scene>& scene, const char* method, const char* which, const char* where, auto upsert,
                 const char* text) {
  const LightData light;
  scene.def(
      method,
      [upsert](Scene& self, Which ids, const std::string& name, const std::string& kind, nb::object place, Color color,
               float power, std::optional<std::uint32_t> flags, bool normalize, float radius, float angle, float size_x,
               float size_y, bool ellipse, float spread, float spot_size, float spot_blend) {
        upsert(self, ids, name, place, [&](const std::string& label) {
          return light_data(label, name, kind, color, power, flags, normalize, radius, angle, size_x, size_y, ellipse,
                            spread, spot_size, spot_blend);
        });
      },
      nb::arg(which), "name"_a, "kind"_a, nb::arg(where), nb::kw_only(), "color"_a = light.color,
      "power"_a = light.power, "flags"_a = nb::none(), "normalize"_a = light.normalize, "radius"_a = light.radius,
      "angle"_a = light.angle, "size_x"_a = light.size_x, "size_y"_a = light.size_y, "ellipse"_a = light.ellipse,
      "spread"_a = light.spread, "spot_size"_a = light.spot_size, "spot_blend"_a = light.spot_blend, text);
}

}  // namespace

void bind_lights(nb::class_<Scene>& scene) {
  bind_upsert<Id>(
      scene, "upsert_light", "id", "matrix", [](auto&&... given) { upsert_light(given...); },
      "Sets a lamp; units and conventions are Blender's.\n\n"
      "kind: \"point\", \"spot\", \"sun\" or \"area\". matrix: (3, 4), it shines along its -Z.\n"
      "color: linear, times the strength of its nodes. power: W, for a sun W/m^2.\n"
      "flags: HW_LIGHT_* bits. normalize: power does not grow with size.\n"
      "radius: metres (point, spot). angle: full angle, radians (sun). size_x, size_y: metres; ellipse; spread: full\n"
      "angle, radians (area). spot_size: full cone angle, radians; spot_blend: 0 to 1 (spot).");
  bind_upsert<nb::object>(
      scene, "upsert_lights", "ids", "matrices", [](auto&&... given) { upsert_lights(given...); },
      "Sets lamps that are alike but for their place.\n\n"
      "ids: (N,) uint64, quickest in rising order. matrices: (N, 3, 4) float32. The rest as upsert_light.");
  scene.def("remove_light", &Scene::remove_light, "id"_a, "Removes a lamp.")
      .def(
          "remove_lights",
          [](Scene& self, nb::object ids) {
            AnyArray numbers;
            self.remove_lights(take_ids(ids, "lights: ids", numbers));
          },
          "ids"_a, "Removes lamps. ids: (N,) uint64; SceneError when one of them does not exist.");
}

}  // namespace hw::python

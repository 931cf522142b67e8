// SPDX-License-Identifier: Apache-2.0
// One setter for each member of RenderSettings, found by name.
#include "python/settings.h"

#include <nanobind/stl/string.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace hw::python {

namespace nb = nanobind;

namespace {

[[noreturn]] void wrong_type(const std::string& key, const char* wanted, nb::handle value) {
  throw nb::type_error(("setting \"" + key + "\" must be " + wanted + ", not " +
                        nb::cast<std::string>(nb::str(nb::type_name(value.type()))))
                           .c_str());
}

void take(const std::string& key, nb::handle value, std::uint32_t& out) {
  PyObject* whole = PyNumber_Index(value.ptr());  // takes NumPy's integers, refuses floats
  if (!whole) {
    PyErr_Clear();
    wrong_type(key, "a whole number", value);
  }
  const nb::object held = nb::steal(whole);
  if (!nb::try_cast<std::uint32_t>(held, out))
    throw nb::value_error(
        ("setting \"" + key + "\" must be from 0 to 4294967295, not " + nb::cast<std::string>(nb::str(held))).c_str());
}

void take(const std::string& key, nb::handle value, double& out) {
  const double number = nb::isinstance<nb::str>(value) ? -1.0 : PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() || nb::isinstance<nb::str>(value)) {
    PyErr_Clear();
    wrong_type(key, "a number", value);
  }
  if (!std::isfinite(number)) throw nb::value_error(("setting \"" + key + "\" must be a finite number").c_str());
  out = number;
}

void take(const std::string& key, nb::handle value, float& out) {
  double number = 0;
  take(key, value, number);
  out = static_cast<float>(number);
  if (!std::isfinite(out)) throw nb::value_error(("setting \"" + key + "\" is too large").c_str());
}

void take(const std::string& key, nb::handle value, bool& out) {
  if (nb::isinstance<nb::bool_>(value)) {
    out = nb::cast<bool>(value);
    return;
  }
  std::uint32_t number = 2;
  if (PyObject* whole = PyNumber_Index(value.ptr())) {
    nb::try_cast<std::uint32_t>(nb::steal(whole), number);
  } else {
    PyErr_Clear();
  }
  if (number > 1) wrong_type(key, "True or False", value);
  out = number == 1;
}

void take(const std::string& key, nb::handle value, std::string& out) {
  if (!nb::isinstance<nb::str>(value)) wrong_type(key, "a string", value);
  out = nb::cast<std::string>(value);
}

nb::object sequence(const std::string& key, nb::handle value, const char* wanted) {
  if (nb::isinstance<nb::str>(value)) wrong_type(key, wanted, value);
  PyObject* items = PySequence_List(value.ptr());
  if (!items) {
    PyErr_Clear();
    wrong_type(key, wanted, value);
  }
  return nb::steal(items);
}

void take(const std::string& key, nb::handle value, std::array<std::uint32_t, 4>& out) {
  const nb::object items = sequence(key, value, "four whole numbers (x0, y0, x1, y1)");
  if (nb::len(items) != 4)
    throw nb::value_error(("setting \"" + key + "\" must be four whole numbers (x0, y0, x1, y1)").c_str());
  for (std::size_t i = 0; i < 4; ++i) take(key, items[i], out[i]);
}

void take(const std::string& key, nb::handle value, std::vector<std::string>& out) {
  const nb::object items = sequence(key, value, "a list of names");
  out.clear();
  for (nb::handle item : items) take(key, item, out.emplace_back());
}

// None: the integrator's own default.
template <class T>
void take(const std::string& key, nb::handle value, std::optional<T>& out) {
  out.reset();
  if (value.is_none()) return;
  T given{};
  take(key, value, given);
  out = given;
}

using Setter = std::function<void(RenderSettings&, const std::string&, nb::handle)>;

const std::map<std::string, Setter>& setters() {
  static const std::map<std::string, Setter> table = [] {
    std::map<std::string, Setter> t;
#define HW_SETTING(name) \
  t[#name] = [](RenderSettings& s, const std::string& key, nb::handle value) { take(key, value, s.name); }
    HW_SETTING(width), HW_SETTING(height), HW_SETTING(region), HW_SETTING(samples), HW_SETTING(first_sample),
        HW_SETTING(seed);
    HW_SETTING(adaptive_sampling), HW_SETTING(noise_threshold), HW_SETTING(adaptive_min_samples);
    HW_SETTING(time_limit), HW_SETTING(integrator), HW_SETTING(lights), HW_SETTING(max_bounces),
        HW_SETTING(diffuse_bounces);
    HW_SETTING(glossy_bounces), HW_SETTING(transmission_bounces), HW_SETTING(transparent_bounces),
        HW_SETTING(min_bounces);
    HW_SETTING(clamp_direct), HW_SETTING(clamp_indirect), HW_SETTING(filter_glossy), HW_SETTING(caustics_reflective);
    HW_SETTING(caustics_refractive), HW_SETTING(filter), HW_SETTING(filter_width), HW_SETTING(transparent_film);
    HW_SETTING(transparent_glass), HW_SETTING(exposure), HW_SETTING(mist_start), HW_SETTING(mist_depth),
        HW_SETTING(mist_falloff);
    HW_SETTING(pass_alpha_threshold), HW_SETTING(tile_pixels), HW_SETTING(passes), HW_SETTING(continue_history),
        HW_SETTING(resume);
#undef HW_SETTING
#define HW_REUSE(name) \
  t[#name] = [](RenderSettings& s, const std::string& key, nb::handle value) { take(key, value, s.reuse.name); }
    HW_REUSE(estimator), HW_REUSE(candidates), HW_REUSE(indirect_candidates), HW_REUSE(neighbours);
    HW_REUSE(reuse_radius), HW_REUSE(ascension), HW_REUSE(grid_radius), HW_REUSE(grid_resolution);
    HW_REUSE(grid_extent), HW_REUSE(cell_inputs), HW_REUSE(points_per_leaf), HW_REUSE(reservoirs_per_cell),
        HW_REUSE(reservoir_memory), HW_REUSE(light_samples), HW_REUSE(bounce_samples), HW_REUSE(path_reuse);
    HW_REUSE(history), HW_REUSE(temporal_reuse), HW_REUSE(spatial_reuse), HW_REUSE(visibility_reuse);
    HW_REUSE(reuse_weights), HW_REUSE(mis_weights), HW_REUSE(grid_follow), HW_REUSE(empty_cells);
#undef HW_REUSE
    t["mist"] = [](RenderSettings& s, const std::string& key, nb::handle value) {
      const nb::object items = sequence(key, value, "(start, depth, falloff)");
      if (nb::len(items) != 3) throw nb::value_error("setting \"mist\" must be (start, depth, falloff)");
      take(key, items[0], s.mist_start);
      take(key, items[1], s.mist_depth);
      take(key, items[2], s.mist_falloff);
    };
    return t;
  }();
  return table;
}

}  // namespace

RenderSettings take_settings(const nb::dict& given) {
  RenderSettings settings;
  for (const auto& [key_object, value] : given) {
    if (!nb::isinstance<nb::str>(key_object)) throw nb::type_error("the names of settings must be strings");
    const std::string key = nb::cast<std::string>(key_object);
    const auto setter = setters().find(key);
    if (setter == setters().end()) {
      std::string known;
      for (const auto& [name, fn] : setters()) known += (known.empty() ? "" : ", ") + name;
      throw nb::value_error(("unknown setting \"" + key + "\" (known: " + known + ")").c_str());
    }
    setter->second(settings, key, value);
  }
  return settings;
}

}  // namespace hw::python

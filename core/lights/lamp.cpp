// SPDX-License-Identifier: Apache-2.0
// One lamp's settings in Blender's units to the record that shaders sample. Facts of Cycles 5.0: a lamp's power is
// divided by its area and pi (a true point's area is taken as 4), a sun's by the area of its disk of directions;
// Normalize off leaves out the area. Scale changes the size of area lamps and the cone of spots, not radii.
#include <algorithm>
#include <cmath>

#include "lib/warp.h"
#include "lights/light_table.h"

namespace hw {
namespace {

constexpr double kPi = 3.14159265358979323846;

vec3 column(const Matrix34& m, int i) { return vec3(m[i], m[4 + i], m[8 + i]); }

bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Mean of the channels: what selection goes by.
double brightness(vec3 v) { return (std::max(v.x, 0.0f) + std::max(v.y, 0.0f) + std::max(v.z, 0.0f)) / 3.0; }

struct Axes {
  vec3 x, y, z;
};

// Radius, emission and axes of a point or spot lamp. Returns the flux estimate.
double fill_sphere(const LightData& data, const Axes& c, Lamp& lamp) {
  LightRecord& r = lamp.record;
  const double radius = data.radius > 0 ? data.radius : 0;
  const double area = radius > 0 ? 4 * kPi * radius * radius : 4;
  const double factor = (data.normalize ? 1 / area : 1) / kPi;
  r.emission *= static_cast<float>(factor);
  r.size_x = static_cast<float>(radius);
  r.axis_x = vec3(1, 0, 0);
  r.axis_y = vec3(0, 1, 0);
  r.axis_z = vec3(0, 0, 1);
  const bool disk = (data.flags & HW_LIGHT_SOFT_FALLOFF) != 0;
  if (!(radius > 0)) {
    r.flags &= ~HW_LIGHT_USE_MIS;
  } else {
    lamp.shape.shape = disk ? HW_LAMP_SHAPE_FACING_DISK : HW_LAMP_SHAPE_SPHERE;
    lamp.shape.radius = r.size_x;
  }
  // Radiant intensity over the sphere of directions; a disk facing everyone has the sphere's.
  double flux = 4 * kPi * brightness(r.emission) * (radius > 0 ? kPi * radius * radius : 1);
  if (data.type == HW_LIGHT_SPOT) {
    const glm::dmat3 m(c.x.x, c.x.y, c.x.z, c.y.x, c.y.y, c.y.z, c.z.x, c.z.y, c.z.z);
    const double det = glm::determinant(m);
    const double scale = glm::length(m[0]) * glm::length(m[1]) * glm::length(m[2]);
    if (!(std::abs(det) > 1e-12 * scale)) {
      lamp.reason = "its matrix is flat, so the spot has no cone";
      return 0;
    }
    const glm::dmat3 inverse = glm::inverse(m);
    // A common factor does not change the cone; unit scale keeps the numbers in range.
    const double unit = std::cbrt(std::abs(det));
    r.axis_x = vec3(inverse[0][0], inverse[1][0], inverse[2][0]) * static_cast<float>(unit);
    r.axis_y = vec3(inverse[0][1], inverse[1][1], inverse[2][1]) * static_cast<float>(unit);
    r.axis_z = vec3(inverse[0][2], inverse[1][2], inverse[2][2]) * static_cast<float>(unit);
    const double half = 0.5 * std::clamp(static_cast<double>(data.spot_size), 1e-4, kPi);
    const double cosine = std::cos(half);
    const double widest = std::max(glm::length(m[0]), glm::length(m[1])) / glm::length(m[2]) * std::tan(half);
    r.spread_or_spot = static_cast<float>(cosine);
    r.spot_smooth = static_cast<float>(std::min(1 / std::max((1 - cosine) * data.spot_blend, 1e-20), 1e20));
    // 1 - 1 / sqrt(1 + t^2) without cancellation.
    const double secant = std::sqrt(1 + widest * widest);
    r.size_y = static_cast<float>(half >= 0.5 * kPi ? 1.0 : widest * widest / (secant * (secant + 1)));
    flux *= std::max(0.5 * r.size_y, 1e-6);
  }
  return flux;
}

double fill_sun(const LightData& data, const Axes& c, double scene_radius, Lamp& lamp) {
  LightRecord& r = lamp.record;
  const double half = 0.5 * std::clamp(static_cast<double>(data.angle), 0.0, kPi);
  const double area = half > 0 ? kPi * std::sin(half) * std::sin(half) : 1;
  r.emission *= static_cast<float>(data.normalize ? 1 / area : 1);
  r.axis_z = glm::normalize(c.z);
  warp_frame(r.axis_z, r.axis_x, r.axis_y);
  r.size_x = static_cast<float>(half);
  r.size_y = static_cast<float>(2 * std::sin(0.5 * half) * std::sin(0.5 * half));
  if (!(half > 0)) r.flags &= ~HW_LIGHT_USE_MIS;
  return brightness(r.emission) * area * kPi * scene_radius * scene_radius;
}

double fill_area(const LightData& data, const Axes& c, Lamp& lamp) {
  LightRecord& r = lamp.record;
  const double width = std::abs(data.size_x) * glm::length(c.x), height = std::abs(data.size_y) * glm::length(c.y);
  const double area = width * height * (data.ellipse ? 0.25 * kPi : 1);
  if (!(area > 0) || !std::isfinite(area)) {
    lamp.reason = "its area is zero";
    return 0;
  }
  r.axis_x = glm::normalize(c.x);
  // Sheared matrices (a rotated child of a scaled parent) still give a rectangle.
  const vec3 across = c.y - r.axis_x * glm::dot(c.y, r.axis_x);
  if (!(glm::dot(across, across) > 1e-12f * glm::dot(c.y, c.y))) {
    lamp.reason = "its matrix is flat";
    return 0;
  }
  r.axis_y = glm::normalize(across);
  r.axis_z = glm::cross(r.axis_x, r.axis_y);
  if (glm::dot(r.axis_z, c.z) < 0) {
    r.axis_y = -r.axis_y;
    r.axis_z = -r.axis_z;
  }
  r.size_x = static_cast<float>(width);
  r.size_y = static_cast<float>(height);
  r.emission *= static_cast<float>((data.normalize ? 1 / area : 1) / kPi);
  if (data.ellipse) r.flags |= HW_LIGHT_ELLIPSE;
  // Slats let light through up to half the spread: the normalisation is the inverse of the integral of
  // cos x (1 - tan x / tan h) over the cone, with tan h taken out; by series for small angles.
  const double half = 0.5 * std::clamp(static_cast<double>(data.spread), 0.0, kPi);
  if (half > 0.5 * kPi - 1e-4) {
    r.spread_or_spot = HW_INFINITY;
    r.spot_smooth = 0;
  } else if (half > 0) {
    r.spread_or_spot = static_cast<float>(std::tan(half));
    r.spot_smooth =
        static_cast<float>(std::min(half > 0.05 ? 1 / (std::tan(half) - half) : 3 / (half * half * half), 1e30));
  } else {
    r.spread_or_spot = 0;
    r.spot_smooth = 1;
    r.flags &= ~HW_LIGHT_USE_MIS;
  }
  lamp.shape.shape = data.ellipse ? HW_LAMP_SHAPE_ELLIPSE : HW_LAMP_SHAPE_RECTANGLE;
  lamp.shape.axis_x = r.axis_x * (0.5f * r.size_x);
  lamp.shape.axis_y = r.axis_y * (0.5f * r.size_y);
  r.area = static_cast<float>(area);
  return kPi * area * brightness(r.emission);
}

}  // namespace

Lamp make_lamp(const LightData& data, float scene_radius) {
  Lamp lamp;
  lamp.record = LightRecord{};
  lamp.shape = LampShape{};
  LightRecord& r = lamp.record;
  LampShape& shape = lamp.shape;
  const Matrix34& m = data.object_to_world;
  const Axes c{column(m, 0), column(m, 1), column(m, 2)};
  r.type = data.type;
  r.flags = data.flags & ~(HW_LIGHT_ELLIPSE | HW_LIGHT_SHADER | HW_LIGHT_TWO_SIDED);
  if (data.type > HW_LIGHT_SPOT) r.flags &= ~HW_LIGHT_SOFT_FALLOFF;
  r.position = column(m, 3);
  r.axis_x = vec3(1, 0, 0);
  r.axis_y = vec3(0, 1, 0);
  r.axis_z = vec3(0, 0, 1);
  r.instance = HW_NONE;
  r.material = HW_NONE;
  r.emission = vec3(data.color[0], data.color[1], data.color[2]) * data.power;
  shape.shape = HW_LAMP_SHAPE_NONE;
  shape.center = r.position;

  const bool sizes = std::isfinite(data.radius) && std::isfinite(data.angle) && std::isfinite(data.size_x) &&
                     std::isfinite(data.size_y) && std::isfinite(data.spread) && std::isfinite(data.spot_size) &&
                     std::isfinite(data.spot_blend);
  double flux = 0;
  if (!finite(c.x) || !finite(c.y) || !finite(c.z) || !finite(r.position)) {
    lamp.reason = "its matrix is not finite";
    r.position = shape.center = vec3(0);
  } else if (!finite(r.emission)) {
    lamp.reason = "its power or colour is not finite";
  } else if (!sizes) {
    lamp.reason = "its size is not finite";
  } else if (!(brightness(r.emission) > 0)) {
    lamp.reason = "its power is not positive";
  } else if (data.type == HW_LIGHT_AREA) {
    flux = fill_area(data, c, lamp);
  } else if (data.type == HW_LIGHT_SUN) {
    if (glm::dot(c.z, c.z) > 0) {
      flux = fill_sun(data, c, scene_radius, lamp);
    } else {
      lamp.reason = "its matrix is flat";
    }
  } else if (data.type <= HW_LIGHT_SPOT) {
    flux = fill_sphere(data, c, lamp);
  } else {
    lamp.reason = "its kind is unknown";
  }
  r.emission = glm::max(r.emission, vec3(0));
  // Cycles: no ray finds a lamp without multiple importance sampling, not even the camera's.
  if ((r.flags & HW_LIGHT_USE_MIS) == 0) shape.shape = HW_LAMP_SHAPE_NONE;
  if (lamp.reason.empty() && !(finite(r.emission) && std::isfinite(flux) && flux > 0)) {
    lamp.reason = "its radiance is out of range";
  }
  if (!lamp.reason.empty()) {
    r.emission = vec3(0);
    r.flags &= ~(HW_LIGHT_USE_MIS | HW_LIGHT_CAMERA);
    shape.shape = HW_LAMP_SHAPE_NONE;
    flux = 0;
  }
  lamp.flux = static_cast<float>(std::min(flux, 3e38));
  return lamp;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Bounds of each kind of light, and of unions.
#include "lights/light_bounds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lib/frame.h"
#include "shared/light_tree.h"

namespace hw {
namespace {

constexpr float kHalfPi = 0.5f * HW_PI;

vec3 to_unit(vec3 v, vec3 otherwise) {
  const float length2 = glm::dot(v, v);
  return length2 > 0 && std::isfinite(length2) ? v / std::sqrt(length2) : otherwise;
}

// By the arc tangent: exact for small angles.
float angle_between(vec3 a, vec3 b) { return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)); }

void fill_spot(const LightRecord& r, LightBounds& b) {
  b.theta_e = 0;
  // The rows of the inverse matrix: at right angles where the lamp's own axes are.
  const vec3 x = to_unit(r.axis_x, vec3(1, 0, 0)), y = to_unit(r.axis_y, vec3(0, 1, 0)),
             z = to_unit(r.axis_z, vec3(0, 0, 1));
  const float skew = std::max({std::abs(glm::dot(x, y)), std::abs(glm::dot(y, z)), std::abs(glm::dot(z, x))});
  b.axis = -z;  // axis_z leads from what it shines on to the lamp
  b.theta_o = skew > 1e-3f ? HW_PI : std::acos(std::clamp(1 - r.size_y, -1.0f, 1.0f)) + skew;
}

}  // namespace

LightBounds light_bounds(const LightRecord& r, float weight, float scene_radius) {
  LightBounds b;
  const double flux = weight, pi = HW_PI, area = pi * scene_radius * scene_radius;
  double power = 0;
  vec3 half(0);
  vec3 middle = r.position;
  if (r.type == HW_LIGHT_TRIANGLE) {
    const vec3 v1 = r.position + r.axis_x, v2 = r.position + r.axis_y;
    b.low = glm::min(r.position, glm::min(v1, v2));
    b.high = glm::max(r.position, glm::max(v1, v2));
    b.axis = r.axis_z;
    b.theta_e = kHalfPi;
    b.two_sided = (r.flags & HW_LIGHT_TWO_SIDED) != 0;
    power = flux / (b.two_sided ? 2 * pi : pi);
  } else if (r.type == HW_LIGHT_SUN || r.type == HW_LIGHT_WORLD) {
    const bool world = r.type == HW_LIGHT_WORLD;
    b.distant = true;
    b.axis = b.low = b.high = r.axis_z;
    b.theta_o = world ? HW_PI : std::min(r.size_x, HW_PI);
    b.theta_e = 0;
    power = flux / (world ? 4 * area : area);  // on a surface: pi times the mean radiance
  } else if (r.type == HW_LIGHT_AREA) {
    half = glm::abs(r.axis_x) * (0.5f * r.size_x) + glm::abs(r.axis_y) * (0.5f * r.size_y);
    b.axis = -r.axis_z;
    const bool limited = r.spot_smooth > 0;
    const bool parallel = limited && !(r.spread_or_spot > 0);
    b.theta_e = limited ? std::min(std::atan(r.spread_or_spot), kHalfPi) : kHalfPi;
    power = flux / pi * (parallel ? pi : limited ? double{r.spread_or_spot} * r.spot_smooth : 1.0);
  } else {
    half = vec3(r.size_x);
    b.theta_o = HW_PI;
    b.theta_e = kHalfPi;
    power = flux / (4 * pi);
    if (r.type == HW_LIGHT_SPOT) {
      fill_spot(r, b);
      power /= std::max(0.5 * r.size_y, 1e-6);
    }
  }
  if (r.type != HW_LIGHT_TRIANGLE && !b.distant) {
    b.low = middle - half;
    b.high = middle + half;
  }
  const vec3 furthest = glm::max(glm::abs(b.low), glm::abs(b.high));
  if (!(std::max({furthest.x, furthest.y, furthest.z}) < HW_LIGHT_TREE_UNBOUNDED)) {
    b.low = vec3(-HW_LIGHT_TREE_UNBOUNDED);
    b.high = vec3(HW_LIGHT_TREE_UNBOUNDED);
  }
  b.power = static_cast<float>(std::clamp(power, 1e-37, 3e38));
  return b;
}

LightBounds unite(const LightBounds& first, const LightBounds& second) {
  LightBounds u;
  u.power = std::min(first.power + second.power, 3e38f);
  if (first.distant != second.distant) {
    u.low = vec3(-HW_LIGHT_TREE_UNBOUNDED);
    u.high = vec3(HW_LIGHT_TREE_UNBOUNDED);
    u.theta_o = HW_PI;
    u.theta_e = kHalfPi;
    return u;
  }
  u.low = glm::min(first.low, second.low);
  u.high = glm::max(first.high, second.high);
  u.distant = first.distant;
  u.two_sided = first.two_sided || second.two_sided;
  u.theta_e = std::max(first.theta_e, second.theta_e);
  const bool swapped = second.theta_o > first.theta_o;
  const LightBounds& wide = swapped ? second : first;
  const LightBounds& narrow = swapped ? first : second;
  // What shines both ways may be turned round.
  const vec3 other = u.two_sided && glm::dot(wide.axis, narrow.axis) < 0 ? -narrow.axis : narrow.axis;
  const float between = angle_between(wide.axis, other);
  u.axis = wide.axis;
  u.theta_o = wide.theta_o;
  if (std::min(between + narrow.theta_o, HW_PI) <= wide.theta_o) return u;
  u.theta_o = 0.5f * (wide.theta_o + between + narrow.theta_o);
  if (!(u.theta_o < HW_PI)) {
    u.theta_o = HW_PI;
    return u;
  }
  const float turn = u.theta_o - wide.theta_o;
  const vec3 across = to_unit(other - wide.axis * glm::dot(other, wide.axis), vec3(0));
  if (across == vec3(0)) {  // against one another: no way is the shorter
    u.theta_o = HW_PI;
    return u;
  }
  u.axis = to_unit(wide.axis * std::cos(turn) + across * std::sin(turn), wide.axis);
  return u;
}

}  // namespace hw

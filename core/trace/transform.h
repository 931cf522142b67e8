// SPDX-License-Identifier: Apache-2.0
// Instance matrices as Tracers need them: row-major 3x4, object to world.
#pragma once

#include <cmath>

namespace hw {

// False for a matrix that maps space to a plane, line or point (or to nothing finite): its inverse does not exist in
// single precision, and the instance is not hit. Judged by the determinant against the columns' lengths.
inline bool invertible(const float* m) {
  const double a[3] = {m[0], m[4], m[8]}, b[3] = {m[1], m[5], m[9]}, c[3] = {m[2], m[6], m[10]};
  const double determinant =
      a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1]);
  const auto length2 = [](const double* v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; };
  const double scale = std::sqrt(length2(a) * length2(b) * length2(c));
  if (!std::isfinite(m[3]) || !std::isfinite(m[7]) || !std::isfinite(m[11])) return false;
  // Smaller ones would put rays, seen from the object, past what Tracers can hold.
  if (!(length2(a) > 1e-24 && length2(b) > 1e-24 && length2(c) > 1e-24)) return false;
  return std::abs(determinant) > 1e-6 * scale && std::isfinite(scale);
}

}  // namespace hw

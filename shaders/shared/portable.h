// SPDX-License-Identifier: Apache-2.0
// Lets one header compile as C++20 (with glm) and as GLSL 4.60: vector types, qualifiers, scalar layout.
// Every header under shaders/shared and every maths header (*.h) under shaders/lib includes this first.
//
// Rules for such headers
//  - structs hold only float, uint, int, uint64_t, vec2, vec3, vec4 and fixed arrays of them; they are read with
//    layout(scalar), so that C++ and GLSL agree byte for byte; each has HW_CHECK_SIZE behind it;
//  - functions are declared HW_FN and take HW_IN(T) (large structs) / HW_OUT(T) / HW_INOUT(T) parameters; constants are
//  HW_CONST;
//  - no swizzle assignment, no implicit int-to-float conversion, no default arguments, `f`-suffix on float literals.
#ifndef HW_PORTABLE_H
#define HW_PORTABLE_H

#ifdef __cplusplus

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <glm/glm.hpp>

namespace hw {
using uint = std::uint32_t;
using glm::abs;
using glm::acos;
using glm::all;
using glm::asin;
using glm::atan;
using glm::ceil;
using glm::clamp;
using glm::cos;
using glm::cross;
using glm::distance;
using glm::dot;
using glm::exp;
using glm::exp2;
using glm::floor;
using glm::fract;
using glm::inversesqrt;
using glm::isinf;
using glm::isnan;
using glm::ivec2;
using glm::length;
using glm::log;
using glm::log2;
using glm::mat3;
using glm::max;
using glm::min;
using glm::mix;
using glm::mod;
using glm::normalize;
using glm::pow;
using glm::reflect;
using glm::sign;
using glm::sin;
using glm::smoothstep;
using glm::sqrt;
using glm::step;
using glm::tan;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
inline uint floatBitsToUint(float x) {
  uint u;
  std::memcpy(&u, &x, 4);
  return u;
}
inline float uintBitsToFloat(uint u) {
  float x;
  std::memcpy(&x, &u, 4);
  return x;
}
inline int floatBitsToInt(float x) {
  int u;
  std::memcpy(&u, &x, 4);
  return u;
}
inline float intBitsToFloat(int u) {
  float x;
  std::memcpy(&x, &u, 4);
  return x;
}
}  // namespace hw

#define HW_FN inline
#define HW_CONST constexpr
#define HW_IN(T) const T&
#define HW_OUT(T) T&
#define HW_INOUT(T) T&
#define HW_NAMESPACE_BEGIN namespace hw {
#define HW_NAMESPACE_END }
#define HW_CHECK_SIZE(T, N) static_assert(sizeof(T) == (N), #T " must have the same size in C++ and GLSL");
#define HW_CHECK_OFFSET(T, member, N) static_assert(offsetof(T, member) == (N), #T "::" #member " has moved");

#else

#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_control_flow_attributes : require

#define HW_FN
#define HW_CONST const
#define HW_IN(T) T
#define HW_OUT(T) out T
#define HW_INOUT(T) inout T
#define HW_NAMESPACE_BEGIN
#define HW_NAMESPACE_END
#define HW_CHECK_SIZE(T, N)
#define HW_CHECK_OFFSET(T, member, N)

#endif

HW_NAMESPACE_BEGIN
HW_CONST float HW_PI = 3.14159265358979323846f;
HW_CONST float HW_INV_PI = 0.31830988618379067154f;
HW_CONST float HW_INFINITY = 3.402823466e+38f;  // largest float: a ray's tmax when it is unbounded
HW_CONST uint HW_NONE = 0xFFFFFFFFu;            // no index, no hit, no light
HW_NAMESPACE_END

#endif

// SPDX-License-Identifier: Apache-2.0
// NumPy arrays (or anything with the buffer or DLPack protocol) as arguments: taken without conversion, with errors
// that name the argument, its type and shape.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

namespace hw::python {

namespace nb = nanobind;
using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;

// A size that a dimension may have; kAny takes every size.
constexpr std::int64_t kAny = -1;

// TypeError when `value` is no array of type `dtype` (as NumPy names it), ValueError when it is not C-contiguous or its
// shape does not match. `what` goes in front of the message: `mesh "Cube" (id 7): positions`.
AnyArray take_array(nb::handle value, const nb::dlpack::dtype& type, const char* dtype,
                    std::initializer_list<std::int64_t> shape, const std::string& what);

// Keeps arrays alive until the last copy of what it returns goes, on whatever thread.
std::shared_ptr<const void> keeper_of(std::vector<AnyArray> arrays);

std::string shape_text(const AnyArray& array);
bool is_contiguous(const AnyArray& array);
// Any array at all: TypeError when it is none.
AnyArray any_array(nb::handle value, const std::string& what);

template <class T>
constexpr const char* dtype_name();
template <>
constexpr const char* dtype_name<float>() {
  return "float32";
}
template <>
constexpr const char* dtype_name<double>() {
  return "float64";
}
template <>
constexpr const char* dtype_name<std::uint32_t>() {
  return "uint32";
}
template <>
constexpr const char* dtype_name<std::uint64_t>() {
  return "uint64";
}
template <>
constexpr const char* dtype_name<std::uint8_t>() {
  return "uint8";
}

template <class T>
AnyArray take(nb::handle value, std::initializer_list<std::int64_t> shape, const std::string& what) {
  return take_array(value, nb::dtype<T>(), dtype_name<T>(), shape, what);
}

// Copies an array's elements; None gives an empty vector.
template <class T>
std::vector<T> copy(nb::handle value, std::initializer_list<std::int64_t> shape, const std::string& what) {
  if (value.is_none()) return {};
  const AnyArray array = take<T>(value, shape, what);
  const T* data = static_cast<const T*>(array.data());
  return std::vector<T>(data, data + array.size());
}

// Twelve numbers, (3, 4) float32 or float64.
std::array<float, 12> take_matrix(nb::handle value, const std::string& what);

}  // namespace hw::python

// SPDX-License-Identifier: Apache-2.0
// Checks of array arguments and the words for what is wrong with them.
#include "python/arrays.h"

#include <nanobind/stl/string.h>

#include <algorithm>

#include "python/gil.h"

namespace hw::python {
namespace {

std::string wanted_shape(std::initializer_list<std::int64_t> shape) {
  static const char* const kNames[] = {"N", "M", "K"};
  std::string text = "(";
  std::size_t axis = 0;
  for (std::int64_t size : shape) {
    if (axis > 0) text += ", ";
    text += size == kAny ? kNames[std::min<std::size_t>(axis, 2)] : std::to_string(size);
    ++axis;
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::string type_text(const nb::dlpack::dtype& type) {
  const auto code = static_cast<nb::dlpack::dtype_code>(type.code);
  const char* kind = code == nb::dlpack::dtype_code::Int     ? "int"
                     : code == nb::dlpack::dtype_code::UInt  ? "uint"
                     : code == nb::dlpack::dtype_code::Float ? "float"
                     : code == nb::dlpack::dtype_code::Bool  ? "bool"
                                                             : "another type of ";
  return kind + (code == nb::dlpack::dtype_code::Bool ? std::string() : std::to_string(type.bits));
}

}  // namespace

std::shared_ptr<const void> keeper_of(std::vector<AnyArray> arrays) {
  const auto drop = [](const std::vector<AnyArray>* kept) {
    if (!nb::is_alive()) return;  // the interpreter ended: its objects are gone
    const WithGil acquire;
    delete kept;
  };
  return std::shared_ptr<const std::vector<AnyArray>>(new std::vector<AnyArray>(std::move(arrays)), drop);
}

std::string shape_text(const AnyArray& array) {
  std::string text = "(";
  for (std::size_t i = 0; i < array.ndim(); ++i) text += (i ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

bool is_contiguous(const AnyArray& array) {
  std::int64_t expected = 1;
  for (std::size_t i = array.ndim(); i-- > 0;) {
    if (array.shape(i) > 1 && array.stride(i) != expected) return array.size() == 0;
    expected *= static_cast<std::int64_t>(array.shape(i));
  }
  return true;
}

AnyArray any_array(nb::handle value, const std::string& what) {
  AnyArray array;
  if (value.is_none() || !nb::try_cast<AnyArray>(value, array)) {
    const std::string message =
        what + " must be an array, not " + nb::cast<std::string>(nb::str(nb::type_name(value.type())));
    throw nb::type_error(message.c_str());
  }
  return array;
}

AnyArray take_array(nb::handle value, const nb::dlpack::dtype& type, const char* dtype,
                    std::initializer_list<std::int64_t> shape, const std::string& what) {
  const AnyArray array = any_array(value, what);
  if (array.dtype() != type) {
    const std::string message = what + " must have type " + dtype + ", not " + type_text(array.dtype());
    throw nb::type_error(message.c_str());
  }
  bool fits = array.ndim() == shape.size();
  std::size_t axis = 0;
  for (std::int64_t size : shape) {
    fits = fits && (size == kAny || static_cast<std::int64_t>(array.shape(axis)) == size);
    ++axis;
  }
  if (!fits) {
    const std::string message = what + " must have shape " + wanted_shape(shape) + ", not " + shape_text(array);
    throw nb::value_error(message.c_str());
  }
  if (!is_contiguous(array)) {
    const std::string message = what + " must be C-contiguous (numpy.ascontiguousarray makes it so)";
    throw nb::value_error(message.c_str());
  }
  return array;
}

std::array<float, 12> take_matrix(nb::handle value, const std::string& what) {
  std::array<float, 12> matrix{};
  const AnyArray array = any_array(value, what);
  if (array.dtype() == nb::dtype<double>()) {  // mathutils and NumPy default to it; twelve numbers cost nothing
    const AnyArray wide = take<double>(value, {3, 4}, what);
    std::transform(static_cast<const double*>(wide.data()), static_cast<const double*>(wide.data()) + 12,
                   matrix.begin(), [](double x) { return static_cast<float>(x); });
    return matrix;
  }
  const AnyArray narrow = take<float>(value, {3, 4}, what);
  std::copy_n(static_cast<const float*>(narrow.data()), 12, matrix.begin());
  return matrix;
}

}  // namespace hw::python

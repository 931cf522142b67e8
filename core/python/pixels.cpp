// SPDX-License-Identifier: Apache-2.0
// Pixels become texels: one channel of bytes stays so, everything else is RGBA of its type.
#include "python/pixels.h"

#include <cstring>
#include <limits>

#include "python/arrays.h"

namespace hw::python {
namespace {

// Leaves `bytes` of texels where they are.
void lend_texels(const AnyArray& pixels, std::size_t bytes, ImageData& image) {
  image.lent = {static_cast<const std::uint8_t*>(pixels.data()), bytes};
  image.keeper = keeper_of({pixels});
}

// Copies pixels of `channels` (1, 3 or 4) into RGBA, alpha from `one` where there is none.
template <class T>
void to_rgba(const T* from, std::size_t count, std::size_t channels, T one, std::vector<std::uint8_t>& out) {
  out.resize(count * 4 * sizeof(T));
  if (channels == 4) {
    std::memcpy(out.data(), from, out.size());
    return;
  }
  std::uint8_t* to = out.data();
  for (std::size_t i = 0; i < count; ++i, from += channels, to += 4 * sizeof(T)) {
    const T pixel[4] = {from[0], from[channels == 3 ? 1 : 0], from[channels == 3 ? 2 : 0], one};
    std::memcpy(to, pixel, sizeof(pixel));
  }
}

}  // namespace

ImageData take_image(nanobind::handle value, const std::string& label, bool lend) {
  ImageData image;
  if (value.is_none()) return image;
  const AnyArray pixels = any_array(value, label + ": pixels");
  const std::size_t channels = pixels.ndim() == 3 ? pixels.shape(2) : 1;
  if ((pixels.ndim() != 2 && pixels.ndim() != 3) || (channels != 1 && channels != 3 && channels != 4))
    throw nb::value_error(
        (label + ": pixels must have shape (H, W), (H, W, 1), (H, W, 3) or (H, W, 4), not " + shape_text(pixels))
            .c_str());
  if (!is_contiguous(pixels))
    throw nb::value_error((label + ": pixels must be C-contiguous (numpy.ascontiguousarray makes it so)").c_str());
  constexpr std::size_t kLargest = std::numeric_limits<std::uint32_t>::max();
  if (pixels.shape(0) > kLargest || pixels.shape(1) > kLargest)
    throw SceneError(label + ": " + shape_text(pixels) + " is too large");
  image.height = static_cast<std::uint32_t>(pixels.shape(0));
  image.width = static_cast<std::uint32_t>(pixels.shape(1));
  const std::size_t count = std::size_t{image.width} * image.height;
  if (count == 0) {
    image.width = image.height = 0;  // an image without pixels is as good as none
    return image;
  }
  const nb::dlpack::dtype type = pixels.dtype();
  const nb::dlpack::dtype half{static_cast<std::uint8_t>(nb::dlpack::dtype_code::Float), 16, 1};
  if (type == nb::dtype<std::uint8_t>() && channels == 1) {
    image.format = HW_TEXEL_R8;
    if (lend) return lend_texels(pixels, count, image), image;
    const auto* data = static_cast<const std::uint8_t*>(pixels.data());
    image.texels.assign(data, data + count);
  } else if (type == nb::dtype<std::uint8_t>()) {
    image.format = HW_TEXEL_RGBA8;
    if (lend && channels == 4) return lend_texels(pixels, 4 * count, image), image;
    to_rgba(static_cast<const std::uint8_t*>(pixels.data()), count, channels, std::uint8_t{255}, image.texels);
  } else if (type == half) {
    image.format = HW_TEXEL_RGBA16F;
    to_rgba(static_cast<const std::uint16_t*>(pixels.data()), count, channels, std::uint16_t{0x3c00}, image.texels);
  } else if (type == nb::dtype<float>()) {
    image.format = HW_TEXEL_RGBA32F;
    to_rgba(static_cast<const float*>(pixels.data()), count, channels, 1.0f, image.texels);
  } else {
    throw nb::type_error((label + ": pixels must have type uint8, float16 or float32").c_str());
  }
  return image;
}

}  // namespace hw::python

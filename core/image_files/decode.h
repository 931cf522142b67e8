// SPDX-License-Identifier: Apache-2.0
// Pixels of JPEG and PNG files, the very bytes that Blender's readers give; whatever might differ is left to Blender.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace hw {

// What an image may have at most: 1 GiB of pixels.
inline constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;

struct DecodedImage {
  std::uint32_t width = 0, height = 0;
  bool opaque = true;                      // the file has no alpha: it is 255 everywhere
  std::unique_ptr<std::uint8_t[]> texels;  // RGBA, bottom row first
};

// Nothing for a file that is damaged, that warns of anything, or that is not plain: 8 bits a channel, grey, RGB or
// RGBA. Never throws for what a file holds; std::bad_alloc where memory does not suffice. Any bytes may come.
std::optional<DecodedImage> decode_image(std::span<const std::uint8_t> file);

// The same for files known by their first bytes. Baseline or progressive, YCbCr at 4:4:4, 4:2:2 or 4:2:0, RGB or grey;
// not CMYK, not arithmetic-coded. Orientation and colour profiles are not looked at: neither does Blender.
std::optional<DecodedImage> decode_jpeg(std::span<const std::uint8_t> file);
// Not interlaced, without a palette or a transparent colour. Gamma and profiles: as above.
std::optional<DecodedImage> decode_png(std::span<const std::uint8_t> file);

}  // namespace hw

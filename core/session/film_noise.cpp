// SPDX-License-Identifier: Apache-2.0
// The measure. The brightness about a pixel is the mean of nine: a single pixel's few samples say as little about its
// brightness as about its noise, and what a bright one is divided by would hide that it is noisy.
#include "session/film_noise.h"

#include <algorithm>
#include <cmath>

namespace hw {

namespace {

constexpr float kDark = 0.1f;

std::vector<float> brightness(std::span<const float> sums, const FilmLayout& layout, std::size_t pixels) {
  const std::size_t stride = layout.pixel_stride(), combined = layout.offset[HW_PASS_COMBINED];
  std::vector<float> out(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* rgb = &sums[i * stride + combined];
    out[i] = (rgb[0] + rgb[1] + rgb[2]) / (3 * sums[i * stride + layout.stride]);
  }
  return out;
}

// Mean of the pixels about (x, y), itself among them.
float about(const std::vector<float>& values, std::uint32_t x, std::uint32_t y, std::uint32_t width,
            std::uint32_t height) {
  const std::uint32_t x0 = x ? x - 1 : 0, x1 = std::min(x + 1, width - 1);
  const std::uint32_t y0 = y ? y - 1 : 0, y1 = std::min(y + 1, height - 1);
  float sum = 0;
  for (std::uint32_t v = y0; v <= y1; ++v)
    for (std::uint32_t u = x0; u <= x1; ++u) sum += values[std::size_t(v) * width + u];
  return sum / float((x1 - x0 + 1) * (y1 - y0 + 1));
}

}  // namespace

std::vector<float> film_noise(std::span<const float> sums, const FilmLayout& layout, std::uint32_t width,
                              std::uint32_t height, float exposure) {
  const std::size_t stride = layout.pixel_stride(), combined = layout.offset[HW_PASS_COMBINED];
  const std::vector<float> bright = brightness(sums, layout, std::size_t(width) * height);
  const std::uint32_t across = blocks_along(width), down = blocks_along(height);
  std::vector<float> out(std::size_t(across) * down, 0.0f), pixels(across);
  for (std::uint32_t y = 0; y < height; ++y) {
    if (y % HW_BLOCK_SIDE == 0) std::fill(pixels.begin(), pixels.end(), 0.0f);
    float* row = &out[std::size_t(y / HW_BLOCK_SIDE) * across];
    for (std::uint32_t x = 0; x < width; ++x) {
      const float* record = &sums[(std::size_t(y) * width + x) * stride];
      const float* extra = record + layout.stride;
      const float even = 1 / extra[1], odd = 1 / (extra[0] - extra[1]);
      float squares = 0;
      for (int c = 0; c < 3; ++c) {
        const float difference = extra[2 + c] * even - (record[combined + c] - extra[2 + c]) * odd;
        squares += difference * difference * (1.0f / 3);
      }
      const float mean = exposure * about(bright, x, y, width, height);
      const float relative = squares * exposure * exposure / (mean * mean + kDark * kDark);
      if (std::isfinite(relative)) row[x / HW_BLOCK_SIDE] += relative;
      pixels[x / HW_BLOCK_SIDE] += 1;
    }
    if ((y + 1) % HW_BLOCK_SIDE == 0 || y + 1 == height)
      for (std::uint32_t i = 0; i < across; ++i) row[i] /= pixels[i];
  }
  return out;
}

}  // namespace hw

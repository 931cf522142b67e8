// SPDX-License-Identifier: Apache-2.0
// PNG (W3C Recommendation, third edition) by libdeflate: 8 bits a channel, grey, RGB or RGBA, not interlaced.
#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "image_files/decode.h"

namespace hw {
namespace {

constexpr std::size_t kSignature = 8, kChunkFrame = 12;  // bytes: before the first chunk; length, type and checksum
constexpr std::uint32_t kMostSide = 1'000'000;           // libpng's limit too

std::uint32_t big_endian(const std::uint8_t* at) {
  return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
}

bool is(const std::uint8_t* type, const char* name) { return std::memcmp(type, name, 4) == 0; }

struct Header {
  std::uint32_t width, height;
  unsigned channels;
};

std::optional<Header> take_header(const std::uint8_t* data, std::size_t size) {
  if (size != 13) return std::nullopt;
  const Header header{big_endian(data), big_endian(data + 4),
                      data[9] == 0   ? 1u
                      : data[9] == 2 ? 3u
                      : data[9] == 6 ? 4u
                                     : 0u};
  const bool plain = data[8] == 8 && header.channels != 0 && data[10] == 0 && data[11] == 0 && data[12] == 0;
  const bool sized = header.width >= 1 && header.height >= 1 && header.width <= kMostSide &&
                     header.height <= kMostSide && std::uint64_t{header.width} * header.height <= kMostPixels;
  return plain && sized ? std::optional(header) : std::nullopt;
}

// The header, and the compressed pixels of all IDAT chunks one behind the other.
bool take_chunks(std::span<const std::uint8_t> file, Header& header, std::vector<std::uint8_t>& packed) {
  bool begun = false, between = false;  // the header was met; something came after the first IDAT
  for (std::size_t at = kSignature; file.size() - at >= kChunkFrame;) {
    const std::size_t size = big_endian(file.data() + at);
    if (size > file.size() - at - kChunkFrame) return false;
    const std::uint8_t* type = file.data() + at + 4;
    const std::uint8_t* data = type + 4;
    const bool critical = !(type[0] & 0x20);
    if (critical && libdeflate_crc32(0, type, size + 4) != big_endian(data + size)) return false;
    if (!begun) {
      const auto found = is(type, "IHDR") ? take_header(data, size) : std::nullopt;
      if (!found) return false;
      header = *found;
      begun = true;
    } else if (is(type, "IDAT")) {
      if (between) return false;
      packed.insert(packed.end(), data, data + size);
    } else if (is(type, "IEND")) {
      return !packed.empty();
    } else {
      // tRNS: a transparent colour; acTL: an animation; PLTE: a palette is only a hint where pixels are RGB.
      if ((critical && !is(type, "PLTE")) || is(type, "tRNS") || is(type, "acTL")) return false;
      between = !packed.empty();
    }
    at += size + kChunkFrame;
  }
  return false;  // no IEND
}

bool unpack(std::span<const std::uint8_t> packed, std::span<std::uint8_t> rows) {
  struct Free {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
  };
  const std::unique_ptr<libdeflate_decompressor, Free> decompressor(libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  std::size_t used = 0;
  return libdeflate_zlib_decompress_ex(decompressor.get(), packed.data(), packed.size(), rows.data(), rows.size(),
                                       &used, nullptr) == LIBDEFLATE_SUCCESS &&
         used == packed.size();
}

std::uint8_t paeth(int left, int up, int corner) {
  const int to_left = std::abs(up - corner), to_up = std::abs(left - corner);
  const int to_corner = std::abs(left + up - 2 * corner);
  if (to_left <= to_up && to_left <= to_corner) return static_cast<std::uint8_t>(left);
  return static_cast<std::uint8_t>(to_up <= to_corner ? up : corner);
}

// Undoes a row's filter in place. `above`: the row before it, undone already; zeros before the first.
template <unsigned kChannels>
bool unfilter(std::uint8_t filter, std::uint8_t* row, const std::uint8_t* above, std::size_t bytes) {
  switch (filter) {
    case 0:
      return true;
    case 1:
      for (std::size_t i = kChannels; i < bytes; ++i) row[i] += row[i - kChannels];
      return true;
    case 2:
      for (std::size_t i = 0; i < bytes; ++i) row[i] += above[i];
      return true;
    case 3:
      for (std::size_t i = 0; i < kChannels; ++i) row[i] += above[i] / 2;
      for (std::size_t i = kChannels; i < bytes; ++i) row[i] += (row[i - kChannels] + above[i]) / 2;
      return true;
    case 4:
      for (std::size_t i = 0; i < kChannels; ++i) row[i] += above[i];
      for (std::size_t i = kChannels; i < bytes; ++i)
        row[i] += paeth(row[i - kChannels], above[i], above[i - kChannels]);
      return true;
    default:
      return false;
  }
}

template <unsigned kChannels>
void to_rgba(const std::uint8_t* row, std::uint32_t width, std::uint8_t* to) {
  for (std::uint32_t x = 0; x < width; ++x, row += kChannels, to += 4) {
    to[0] = row[0];
    to[1] = row[kChannels >= 3 ? 1 : 0];
    to[2] = row[kChannels >= 3 ? 2 : 0];
    to[3] = kChannels == 4 ? row[kChannels - 1] : 255;
  }
}

// rows: each a filter's byte and the row's, top row first.
template <unsigned kChannels>
bool take_rows(std::span<std::uint8_t> rows, DecodedImage& image) {
  const std::size_t bytes = std::size_t{kChannels} * image.width, stride = std::size_t{4} * image.width;
  const std::vector<std::uint8_t> zeros(bytes, 0);
  const std::uint8_t* above = zeros.data();
  for (std::uint32_t y = 0; y < image.height; ++y) {
    std::uint8_t* row = rows.data() + y * (bytes + 1);
    if (!unfilter<kChannels>(row[0], row + 1, above, bytes)) return false;
    above = row + 1;
    to_rgba<kChannels>(above, image.width, image.texels.get() + stride * (image.height - 1 - y));
  }
  return true;
}

}  // namespace

std::optional<DecodedImage> decode_png(std::span<const std::uint8_t> file) {
  if (file.size() < kSignature) return std::nullopt;
  Header header{};
  std::vector<std::uint8_t> packed;
  if (!take_chunks(file, header, packed)) return std::nullopt;
  const std::size_t unpacked = (std::size_t{header.channels} * header.width + 1) * header.height;
  // Deflate makes at most 1032 bytes of one: what a file can't hold is not given memory.
  if (unpacked / 1032 > packed.size()) return std::nullopt;
  const auto memory = std::make_unique_for_overwrite<std::uint8_t[]>(unpacked);
  const std::span rows(memory.get(), unpacked);
  if (!unpack(packed, rows)) return std::nullopt;
  DecodedImage image;
  image.width = header.width;
  image.height = header.height;
  image.opaque = header.channels != 4;
  image.texels = std::make_unique_for_overwrite<std::uint8_t[]>(std::size_t{4} * image.width * image.height);
  const bool taken = header.channels == 1   ? take_rows<1>(rows, image)
                     : header.channels == 3 ? take_rows<3>(rows, image)
                                            : take_rows<4>(rows, image);
  if (!taken) return std::nullopt;
  return image;
}

std::optional<DecodedImage> decode_image(std::span<const std::uint8_t> file) {
  constexpr std::uint8_t kJpeg[] = {0xff, 0xd8, 0xff};
  constexpr std::uint8_t kPng[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const auto begins = [&](std::span<const std::uint8_t> with) {
    return file.size() >= with.size() && std::equal(with.begin(), with.end(), file.begin());
  };
  if (begins(kJpeg)) return decode_jpeg(file);
  if (begins(kPng)) return decode_png(file);
  return std::nullopt;
}

}  // namespace hw

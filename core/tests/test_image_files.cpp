// SPDX-License-Identifier: Apache-2.0
// Image files under the sanitizers: what blender_tests/test_image_files.py asks of pixels is not asked again.
#include <doctest/doctest.h>
#include <libdeflate.h>

#include <algorithm>
#include <random>

#include "image_files/decoder.h"

namespace hw {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(value >> shift));
}

void append_chunk(Bytes& file, const char* type, const Bytes& data) {
  append(file, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = file.size();
  file.insert(file.end(), type, type + 4);
  file.insert(file.end(), data.begin(), data.end());
  append(file, libdeflate_crc32(0, file.data() + begin, file.size() - begin));
}

// A PNG whose rows have all five filters in turn; what is in the rows does not matter. header: the last five bytes.
Bytes png(std::uint32_t width, std::uint32_t height, unsigned channels, const Bytes& header, const Bytes& rows) {
  Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, size;
  append(size, width), append(size, height);
  size.insert(size.end(), header.begin(), header.end());
  append_chunk(file, "IHDR", size);
  Bytes packed(rows.size() + 1000 * (1 + channels));
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(6);
  packed.resize(libdeflate_zlib_compress(compressor, rows.data(), rows.size(), packed.data(), packed.size()));
  libdeflate_free_compressor(compressor);
  append_chunk(file, "IDAT", packed);
  append_chunk(file, "IEND", {});
  return file;
}

Bytes rows_of(std::uint32_t width, std::uint32_t height, unsigned channels, std::mt19937& random) {
  Bytes rows;
  for (std::uint32_t y = 0; y < height; ++y) {
    rows.push_back(static_cast<std::uint8_t>(y % 5));
    for (std::uint32_t i = 0; i < width * channels; ++i) rows.push_back(static_cast<std::uint8_t>(random()));
  }
  return rows;
}

// A grey 8 x 8 JPEG: one block of the mean value, by the shortest tables there are.
Bytes jpeg() {
  Bytes file = {0xff, 0xd8, 0xff, 0xdb, 0, 67, 0};
  file.insert(file.end(), 64, 1);
  const Bytes rest = {
      0xff, 0xc0, 0, 11, 8,    0, 8,    0, 8,  1, 1,    0x11, 0,                               // 8 x 8, grey
      0xff, 0xc4, 0, 20, 0x00, 1, 0,    0, 0,  0, 0,    0,    0,   0, 0, 0, 0, 0, 0, 0, 0, 0,  // DC: "0" is no change
      0xff, 0xc4, 0, 20, 0x10, 1, 0,    0, 0,  0, 0,    0,    0,   0, 0, 0, 0, 0, 0, 0, 0, 0,  // AC: "0" is the end
      0xff, 0xda, 0, 8,  1,    1, 0x00, 0, 63, 0, 0x3f, 0xff, 0xd9};
  file.insert(file.end(), rest.begin(), rest.end());
  return file;
}

}  // namespace

TEST_CASE("image files: whole ones are read") {
  std::mt19937 random(1);
  for (const auto& [channels, type] : {std::pair<unsigned, std::uint8_t>{1, 0}, {3, 2}, {4, 6}}) {
    const Bytes rows = rows_of(7, 11, channels, random);
    const auto image = decode_image(png(7, 11, channels, {8, type, 0, 0, 0}, rows));
    REQUIRE(image);
    CHECK(image->width == 7);
    CHECK(image->height == 11);
    CHECK(image->opaque == (channels != 4));
    CHECK(image->texels[4 * 7 * 10] == rows[1]);  // the first row is stored last, and has no filter
  }
  const auto image = decode_image(jpeg());
  REQUIRE(image);
  CHECK(image->width == 8);
  CHECK(image->texels[0] == 128);
  CHECK(image->texels[3] == 255);
}

TEST_CASE("image files: PNGs that are not plain are left alone") {
  std::mt19937 random(2);
  const Bytes rows = rows_of(4, 4, 3, random);
  CHECK(decode_png(png(4, 4, 3, {8, 2, 0, 0, 0}, rows)));
  for (const Bytes& header : {Bytes{16, 2, 0, 0, 0},
                              {8, 3, 0, 0, 0},
                              {8, 4, 0, 0, 0},
                              {8, 2, 1, 0, 0},
                              {8, 2, 0, 1, 0},
                              {8, 2, 0, 0, 1},
                              {4, 0, 0, 0, 0}})
    CHECK(!decode_png(png(4, 4, 3, header, rows)));
  CHECK(!decode_png(png(4, 5, 3, {8, 2, 0, 0, 0}, rows)));  // too few rows
  CHECK(!decode_png(png(4, 3, 3, {8, 2, 0, 0, 0}, rows)));  // too many
  CHECK(!decode_png(png(0, 4, 3, {8, 2, 0, 0, 0}, {})));
  Bytes bad = rows;
  bad[0] = 5;  // no such filter
  CHECK(!decode_png(png(4, 4, 3, {8, 2, 0, 0, 0}, bad)));
}

TEST_CASE("image files: damage and truncation") {
  std::mt19937 random(3);
  const std::vector<Bytes> files = {jpeg(), png(5, 6, 3, {8, 2, 0, 0, 0}, rows_of(5, 6, 3, random)),
                                    png(5, 6, 4, {8, 6, 0, 0, 0}, rows_of(5, 6, 4, random))};
  for (const Bytes& whole : files) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const Bytes part(whole.begin(),
                       whole.begin() + static_cast<std::ptrdiff_t>(size));  // its end is the allocation's
      CHECK(!decode_image(part));
    }
    for (int i = 0; i < 3000; ++i) {
      Bytes damaged = whole;
      for (unsigned k = 1 + random() % 4; k > 0; --k)
        damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
      if (const auto image = decode_image(damaged))
        CHECK(image->texels[4ull * image->width * image->height - 1] <= 255);  // readable to the end
    }
  }
}

TEST_CASE("image files: a decoder ends with work left") {
  std::mt19937 random(4);
  const Bytes file = png(300, 200, 4, {8, 6, 0, 0, 0}, rows_of(300, 200, 4, random));
  for (unsigned threads = 0; threads < 4; ++threads) {
    ImageDecoder decoder(threads);
    for (std::size_t i = 0; i < 20; ++i) CHECK(decoder.add({file, ""}) == i);
    const auto taken = decoder.take(3), alone = decode_image(file);
    CHECK(std::equal(taken->texels.get(), taken->texels.get() + 4 * 300 * 200, alone->texels.get()));
    CHECK(decoder.done(3));
    CHECK(!decoder.take(3));
    CHECK(!decoder.done(20));
    CHECK_THROWS_AS(decoder.take(20), std::out_of_range);
  }
}

}  // namespace hw

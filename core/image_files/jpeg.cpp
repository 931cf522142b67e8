// SPDX-License-Identifier: Apache-2.0
// JPEG by libjpeg-turbo, which Blender uses too, with its defaults: accurate integer DCT, smooth chroma upsampling.
// A warning is as good as an error here: Blender then reads the file, and says what it has to say.
#include <csetjmp>
#include <cstddef>
#include <cstdio>

// clang-format off
#include <jpeglib.h>  // after cstddef and cstdio: it takes their names for granted
// clang-format on

#include "image_files/decode.h"

namespace hw {
namespace {

constexpr int kMostScans = 100;  // of a progressive file; each takes the time of a whole one, however few bytes it has

struct Reader {
  jpeg_decompress_struct info;
  jpeg_error_mgr errors;
  jpeg_progress_mgr progress;
  std::jmp_buf failed;
};

// The manager is all ours, not jpeg_std_error()'s: it prints nothing, and Debian's static library, whose jerror.o is no
// position-independent code, links into a shared object.
[[noreturn]] void fail(j_common_ptr info) { std::longjmp(static_cast<Reader*>(info->client_data)->failed, 1); }

void note(j_common_ptr info, int level) {
  if (level < 0) fail(info);  // a warning; others are traces
}

void say(j_common_ptr) {}
void text(j_common_ptr, char* buffer) { buffer[0] = 0; }
void reset(j_common_ptr info) { info->err->num_warnings = 0; }

void count_scans(j_common_ptr info) {
  if (info->is_decompressor && reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMostScans) fail(info);
}

// Whether versions of the library agree on the pixels: 4:4:4, 4:2:2 or 4:2:0 of 8 bits, no arithmetic coding.
bool plain(const jpeg_decompress_struct& info) {
  if (info.data_precision != 8 || info.arith_code) return false;
  if (info.num_components == 1) return info.jpeg_color_space == JCS_GRAYSCALE;
  if (info.num_components != 3) return false;
  if (info.jpeg_color_space != JCS_YCbCr && info.jpeg_color_space != JCS_RGB) return false;
  const jpeg_component_info* parts = info.comp_info;
  for (int i = 1; i < 3; ++i)
    if (parts[i].h_samp_factor != 1 || parts[i].v_samp_factor != 1) return false;
  const int across = parts[0].h_samp_factor, down = parts[0].v_samp_factor;
  return (across == 1 && down == 1) || (across == 2 && (down == 1 || down == 2));
}

// A progressive file may end before all bits are told; how that is smoothed differs between versions.
bool complete(const jpeg_decompress_struct& info) {
  if (!info.coef_bits) return true;
  for (int part = 0; part < info.num_components; ++part)
    for (int k = 0; k < DCTSIZE2; ++k)
      if (info.coef_bits[part][k] != 0) return false;
  return true;
}

// Frames between setjmp() and whatever longjmps hold nothing that has a destructor.
bool open(Reader& reader, std::span<const std::uint8_t> file) {
  if (setjmp(reader.failed)) return false;
  jpeg_decompress_struct& info = reader.info;
  jpeg_create_decompress(&info);
  info.progress = &reader.progress;
  jpeg_mem_src(&info, file.data(), static_cast<unsigned long>(file.size()));
  if (jpeg_read_header(&info, TRUE) != JPEG_HEADER_OK || !plain(info)) return false;
  // Every block of 64 takes a bit at least: what a file can't hold is not given memory.
  const std::uint64_t pixels = std::uint64_t{info.image_width} * info.image_height;
  return pixels <= kMostPixels && pixels / 512 <= file.size();
}

bool read(Reader& reader, std::uint8_t* texels) {
  if (setjmp(reader.failed)) return false;
  jpeg_decompress_struct& info = reader.info;
  info.out_color_space = JCS_EXT_RGBA;  // alpha 255
  jpeg_start_decompress(&info);
  if (!complete(info)) return false;
  const std::size_t stride = std::size_t{4} * info.output_width;
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = texels + stride * (info.output_height - 1 - info.output_scanline);
    jpeg_read_scanlines(&info, &row, 1);
  }
  return jpeg_finish_decompress(&info) == TRUE;
}

}  // namespace

std::optional<DecodedImage> decode_jpeg(std::span<const std::uint8_t> file) {
  struct Owner {  // frees what the library holds, also where bad_alloc passes by
    Reader reader{};
    ~Owner() { jpeg_destroy_decompress(&reader.info); }
  } owner;
  Reader& reader = owner.reader;
  reader.info.client_data = &reader;
  reader.info.err = &reader.errors;
  reader.errors.error_exit = fail;
  reader.errors.emit_message = note;
  reader.errors.output_message = say;
  reader.errors.format_message = text;
  reader.errors.reset_error_mgr = reset;
  reader.progress.progress_monitor = count_scans;
  if (!open(reader, file)) return std::nullopt;
  DecodedImage image;
  image.width = reader.info.image_width;
  image.height = reader.info.image_height;
  image.texels = std::make_unique_for_overwrite<std::uint8_t[]>(std::size_t{4} * image.width * image.height);
  if (!read(reader, image.texels.get())) return std::nullopt;
  return image;
}

}  // namespace hw

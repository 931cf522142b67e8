// SPDX-License-Identifier: Apache-2.0
// headwater._core.ImageDecoder: image files decoded beside Python.
#include <nanobind/stl/string.h>

#include <algorithm>
#include <memory>
#include <thread>
#include <vector>

#include "image_files/decoder.h"
#include "python/arrays.h"
#include "python/bind.h"

namespace hw::python {

using namespace nb::literals;

namespace {

constexpr unsigned kMostThreads = 8;

// A decoder, and the Python objects whose bytes it reads.
struct Decoder {
  std::vector<nb::bytes> kept;
  std::unique_ptr<ImageDecoder> decoder;

  Decoder(const nb::list& files, unsigned threads) {
    std::vector<ImageFile> sources;
    for (nb::handle file : files) {
      if (nb::isinstance<nb::bytes>(file)) {
        const auto& bytes = kept.emplace_back(nb::borrow<nb::bytes>(file));
        sources.push_back({{static_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, ""});
      } else if (nb::isinstance<nb::str>(file)) {
        sources.push_back({{}, nb::cast<std::string>(file)});
      } else {
        throw nb::type_error("files: each must be bytes or a path (str)");
      }
    }
    // One core is the caller's.
    if (threads == 0) threads = std::clamp(std::thread::hardware_concurrency(), 2u, kMostThreads + 1) - 1;
    decoder = std::make_unique<ImageDecoder>(std::move(sources), threads);
  }
  ~Decoder() {
    nb::gil_scoped_release release;
    decoder.reset();
  }
};

nb::object take_pixels(Decoder& self, std::size_t index) {
  if (index >= self.decoder->count()) throw nb::index_error("no such file");
  std::unique_ptr<DecodedImage> image;
  {
    nb::gil_scoped_release release;
    if (auto found = self.decoder->take(index)) image = std::make_unique<DecodedImage>(std::move(*found));
  }
  if (!image) return nb::none();
  const std::size_t shape[] = {image->height, image->width, 4};
  std::uint8_t* texels = image->texels.data();
  const bool opaque = image->opaque;
  nb::capsule owner(image.get(), [](void* p) noexcept { delete static_cast<DecodedImage*>(p); });
  image.release();
  return nb::make_tuple(nb::ndarray<nb::numpy, std::uint8_t>(texels, 3, shape, owner), opaque);
}

}  // namespace

void bind_image_files(nb::module_& m) {
  nb::class_<Decoder>(
      m, "ImageDecoder",
      "Decodes image files on threads of its own, from now on and in order: 8-bit JPEG and PNG, grey, RGB or RGBA.")
      .def(nb::init<const nb::list&, unsigned>(), "files"_a, "threads"_a = 0,
           "files: of each its contents (bytes) or its path (str). threads: 0: by the machine's.")
      .def("take", &take_pixels, "index"_a,
           "Waits for a file's pixels: ((H, W, 4) uint8, bottom row first; whether the file has no alpha). None for a\n"
           "file that is damaged, can't be read, or is not one that is read exactly as Blender reads it, and when "
           "called\n"
           "again. IndexError when there is no such file.");
}

}  // namespace hw::python

// SPDX-License-Identifier: Apache-2.0
// headwater._core.ImageDecoder: image files decoded beside Python.
#include <nanobind/stl/string.h>

#include <algorithm>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "image_files/decoder.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/gil.h"

namespace hw::python {

using namespace nb::literals;

namespace {

constexpr unsigned kMostThreads = 8;

// A decoder, and the Python objects whose bytes it reads.
struct Decoder {
  std::vector<nb::bytes> kept;
  std::unique_ptr<ImageDecoder> decoder;

  explicit Decoder(unsigned threads) {
    // One core is the caller's.
    if (threads == 0) threads = std::clamp(std::thread::hardware_concurrency(), 2u, kMostThreads + 1) - 1;
    decoder = std::make_unique<ImageDecoder>(threads);
  }
  ~Decoder() {
    const WithoutGil release;
    decoder.reset();
  }
};

std::size_t add(Decoder& self, nb::handle file) {
  if (nb::isinstance<nb::bytes>(file)) {
    const nb::bytes& bytes = self.kept.emplace_back(nb::borrow<nb::bytes>(file));
    return self.decoder->add({{static_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, ""});
  }
  if (nb::isinstance<nb::str>(file)) {
    std::string path;
    if (!nb::try_cast<std::string>(file, path)) throw nb::value_error("file: a path that is no UTF-8");
    return self.decoder->add({{}, std::move(path)});
  }
  throw nb::type_error("file: bytes or a path (str)");
}

nb::object take_pixels(Decoder& self, std::size_t number) {
  std::unique_ptr<DecodedImage> image;
  {
    const WithoutGil release;
    if (auto found = self.decoder->take(number)) image = std::make_unique<DecodedImage>(std::move(*found));
  }
  if (!image) return nb::none();
  const std::size_t shape[] = {image->height, image->width, 4};
  std::uint8_t* texels = image->texels.get();
  const bool opaque = image->opaque;
  nb::capsule owner(image.get(), [](void* p) noexcept { delete static_cast<DecodedImage*>(p); });
  image.release();
  return nb::make_tuple(nb::ndarray<nb::numpy, std::uint8_t>(texels, 3, shape, owner), opaque);
}

}  // namespace

void bind_image_files(nb::module_& m) {
  nb::class_<Decoder>(m, "ImageDecoder",
                      "Decodes image files on threads of its own, in order: 8-bit JPEG and PNG, grey, RGB or RGBA.")
      .def(nb::init<unsigned>(), "threads"_a = 0, "threads: at most that many, 0: by the machine's.")
      .def("add", &add, "file"_a,
           "Begins to decode a file: its contents (bytes) or its path (str). Returns its number: 0, 1, 2, ...")
      .def(
          "done", [](Decoder& self, std::size_t number) { return self.decoder->done(number); }, "number"_a,
          "Whether take() would not wait.")
      .def("take", &take_pixels, "number"_a,
           "Waits for a file's pixels: ((H, W, 4) uint8, bottom row first; whether the file has no alpha). None for a\n"
           "file that is damaged, can't be read, or is not one that is read exactly as Blender reads it, and when "
           "called\n"
           "again. IndexError when there is no such file.");
}

}  // namespace hw::python

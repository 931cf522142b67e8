// SPDX-License-Identifier: Apache-2.0
// Each thread takes the next file until there is none.
#include "image_files/decoder.h"

#include <algorithm>
#include <fstream>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace hw {
namespace {

constexpr std::streamoff kMostBytes = std::streamoff{1} << 30;  // of a file

std::optional<DecodedImage> decode_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return std::nullopt;
  const std::streamoff size = file.tellg();
  if (size <= 0 || size > kMostBytes) return std::nullopt;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), size)) return std::nullopt;
  return decode_image(bytes);
}

}  // namespace

ImageDecoder::ImageDecoder(std::vector<ImageFile> files, unsigned threads)
    : files_(std::move(files)), results_(files_.size()) {
  const std::size_t wanted = std::min<std::size_t>(std::max(threads, 1u), files_.size());
  for (std::size_t i = 0; i < wanted; ++i) {
    try {
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      if (!threads_.empty()) return;  // those that started do it all
      next_ = files_.size();
      for (Result& result : results_) result.done = true;
      return;
    }
  }
}

ImageDecoder::~ImageDecoder() {
  next_ = files_.size();
  for (std::thread& thread : threads_) thread.join();
}

std::optional<DecodedImage> ImageDecoder::take(std::size_t index) {
  if (index >= files_.size()) throw std::out_of_range("there are " + std::to_string(files_.size()) + " image files");
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return results_[index].done; });
  return std::exchange(results_[index].image, std::nullopt);
}

void ImageDecoder::work() {
  for (std::size_t i; (i = next_.fetch_add(1)) < files_.size();) {
    std::optional<DecodedImage> image;
    try {
      image = files_[i].path.empty() ? decode_image(files_[i].bytes) : decode_file(files_[i].path);
    } catch (const std::bad_alloc&) {  // what the caller does in its stead may say so
    }
    {
      std::lock_guard lock(mutex_);
      results_[i].image = std::move(image);
      results_[i].done = true;
    }
    done_.notify_all();
  }
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Image files decoded on threads of their own while the caller does something else.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "image_files/decode.h"

namespace hw {

// A file's bytes, or where it lies. `bytes` must live as long as the decoder.
struct ImageFile {
  std::span<const std::uint8_t> bytes;
  std::string path;  // empty: it is `bytes`
};

class ImageDecoder {
 public:
  // Begins at once, in order. threads: at least 1; not more than there are files are started.
  ImageDecoder(std::vector<ImageFile> files, unsigned threads);
  ~ImageDecoder();  // waits for the files that are under way; forgets the rest
  ImageDecoder(const ImageDecoder&) = delete;
  ImageDecoder& operator=(const ImageDecoder&) = delete;

  std::size_t count() const { return files_.size(); }
  // Waits for a file's pixels and hands them over: a second call gets nothing. Nothing too where decode_image() gives
  // nothing, where the file can't be read and where memory does not suffice. May be called from any thread.
  std::optional<DecodedImage> take(std::size_t index);

 private:
  struct Result {
    std::optional<DecodedImage> image;
    bool done = false;
  };
  void work();

  const std::vector<ImageFile> files_;
  std::vector<Result> results_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::condition_variable done_;
  std::vector<std::thread> threads_;
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Image files decoded on threads of their own while the caller does something else.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "image_files/decode.h"

namespace hw {

// A file's bytes, or where it lies.
struct ImageFile {
  std::span<const std::uint8_t> bytes;  // must live as long as the decoder
  std::string path;                     // empty: it is `bytes`
};

class ImageDecoder {
 public:
  explicit ImageDecoder(unsigned threads);  // at most that many, at least 1; each starts when a file has need of it
  ~ImageDecoder();                          // waits for the files that are under way; forgets the rest
  ImageDecoder(const ImageDecoder&) = delete;
  ImageDecoder& operator=(const ImageDecoder&) = delete;

  // Begins to decode a file once those before it were begun. Returns its number: 0, 1, 2, …
  std::size_t add(ImageFile file);
  // Waits for a file's pixels and hands them over: a second call gets nothing. Nothing too where decode_image() gives
  // nothing, where the file can't be read and where memory does not suffice. std::out_of_range when there is no such
  // file.
  std::optional<DecodedImage> take(std::size_t number);
  bool done(std::size_t number);  // whether take() would not wait. All three may be called from any thread.

 private:
  struct Job {
    ImageFile file;
    std::optional<DecodedImage> image;
    bool done = false;
  };
  void work();

  const unsigned most_threads_;
  std::mutex mutex_;  // of all that follows, but for the file and the image of a job that is being done
  std::condition_variable added_, done_;
  std::deque<Job> jobs_;  // a deque: references stay good while it grows
  std::size_t next_ = 0;
  unsigned idle_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace hw

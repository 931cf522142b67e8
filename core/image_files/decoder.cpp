// SPDX-License-Identifier: Apache-2.0
// Each thread takes the next file, or waits for one.
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

ImageDecoder::ImageDecoder(unsigned threads) : most_threads_(std::max(threads, 1u)) {}

ImageDecoder::~ImageDecoder() {
  {
    std::lock_guard lock(mutex_);
    ending_ = true;
  }
  added_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::size_t ImageDecoder::add(ImageFile file) {
  std::lock_guard lock(mutex_);
  jobs_.push_back({std::move(file), std::nullopt, false});
  const std::size_t waiting = jobs_.size() - next_;
  if (waiting > idle_ && threads_.size() < most_threads_) try {
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      // No thread to be had: those there are do it, or nobody.
      if (threads_.empty()) {
        jobs_.back().done = true;
        next_ = jobs_.size();
      }
    }
  added_.notify_one();
  return jobs_.size() - 1;
}

std::optional<DecodedImage> ImageDecoder::take(std::size_t number) {
  std::unique_lock lock(mutex_);
  if (number >= jobs_.size()) throw std::out_of_range("there are " + std::to_string(jobs_.size()) + " image files");
  Job& job = jobs_[number];
  done_.wait(lock, [&] { return job.done; });
  return std::exchange(job.image, std::nullopt);
}

bool ImageDecoder::done(std::size_t number) {
  std::lock_guard lock(mutex_);
  return number < jobs_.size() && jobs_[number].done;
}

void ImageDecoder::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    ++idle_;
    added_.wait(lock, [&] { return ending_ || next_ < jobs_.size(); });
    --idle_;
    if (ending_) return;
    Job& job = jobs_[next_++];
    lock.unlock();
    try {
      job.image = job.file.path.empty() ? decode_image(job.file.bytes) : decode_file(job.file.path);
    } catch (const std::bad_alloc&) {  // what the caller does in its stead may say so
    }
    lock.lock();
    job.done = true;
    done_.notify_all();
  }
}

}  // namespace hw

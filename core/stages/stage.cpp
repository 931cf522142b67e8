// SPDX-License-Identifier: Apache-2.0
// Kernel cache.
#include "stages/stage.h"

#include <chrono>

#include "gpu/read_constants.h"

namespace hw {

namespace {

constexpr std::chrono::milliseconds kLook{20};  // between two looks at whether the render was cancelled

}  // namespace

KernelCache::~KernelCache() {
  if (compiler_.joinable()) compiler_.join();
}

const Kernel& KernelCache::get(std::string_view name, const SpecConstants& constants) {
  SpecConstants all = constants;
  const SpecConstants window = device_.window_constants();
  all.insert(all.end(), window.begin(), window.end());
  std::unique_lock lock(mutex_);
  auto read = bits_read_.find(name);
  if (read == bits_read_.end()) read = bits_read_.emplace(name, bits_read(Kernel::words(name))).first;
  const Key key(name, only_read(read->second, all));
  for (;;) {
    if (const auto it = kernels_.find(key); it != kernels_.end()) return *it->second;
    if (const auto* cancelled = cancelled_.load(); cancelled && *cancelled) throw RenderCancelled{};
    if (!compiling_) {
      if (compiler_.joinable()) compiler_.join();
      failure_ = nullptr;
      compiler_ = std::thread([this, key] { compile(key); });
      compiling_ = true;
    }
    compiled_.wait_for(lock, kLook, [this] { return !compiling_; });
    if (!compiling_ && failure_ && failed_ == key) std::rethrow_exception(std::exchange(failure_, nullptr));
  }
}

void KernelCache::wait() {
  std::unique_lock lock(mutex_);
  compiled_.wait(lock, [this] { return !compiling_; });
  if (compiler_.joinable()) compiler_.join();
}

void KernelCache::compile(const Key& key) {
  std::unique_ptr<Kernel> kernel;
  std::exception_ptr failure;
  try {
    kernel = std::make_unique<Kernel>(device_, key.first, key.second);
    if (device_.info().kind == "cpu") run_nothing(*kernel);
  } catch (...) {
    failure = std::current_exception();
  }
  std::lock_guard lock(mutex_);
  if (failure)
    failed_ = key, failure_ = failure;
  else
    kernels_.emplace(key, std::move(kernel));
  compiling_ = false;
  compiled_.notify_all();
}

// Lavapipe compiles a kernel when it is first dispatched, all kernels of a submission in one piece: with many materials
// half a minute in which nothing can be cancelled. A dispatch of no groups makes it compile this one alone, here.
void KernelCache::run_nothing(const Kernel& kernel) {
  constexpr std::size_t kUniformBytes = 16384;
  Commands commands(device_);
  if (!zeros_) {
    zeros_ = std::make_unique<Buffer>(device_, kUniformBytes, BufferUse::device, "zeros");
    commands.fill(*zeros_, 0, kUniformBytes, 0);
  }
  commands.set_uniforms(*zeros_, *zeros_);
  commands.dispatch_indirect(kernel, Push{}.bytes(), *zeros_);
  commands.flush();
}

}  // namespace hw

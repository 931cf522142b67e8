// SPDX-License-Identifier: Apache-2.0
// Kernel cache.
#include "stages/stage.h"

namespace hw {

const Kernel& KernelCache::get(std::string_view name, const SpecConstants& constants) {
  std::lock_guard lock(mutex_);
  auto key = std::make_pair(std::string(name), constants);
  auto it = kernels_.find(key);
  if (it == kernels_.end())
    it = kernels_.emplace(std::move(key), std::make_unique<Kernel>(device_, name, constants)).first;
  return *it->second;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Splits a scene's objects in two by what shading them takes. Each class gets kernels specialised for it (shared/features.h):
// on a device that runs every branch, lavapipe before Mesa 24 above all, the many plain objects of a scene then don't pay
// for its few glasses and noise textures; on others, neighbouring lanes do more alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace hw {

struct ShadingClasses {
  std::uint32_t simple = 0;  // HW_FEATURE_* of the simple class
  std::uint32_t all = 0;     // of everything: the complex class's kernels, and what knows no class
  bool split = false;        // false: one class is enough, everything is simple
  bool is_complex(std::uint32_t features) const { return split && (features & ~simple) != 0; }
};

// `objects`: features needed by an object -> how many objects need exactly those.
ShadingClasses choose_shading_classes(const std::map<std::uint32_t, std::size_t>& objects);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Sorts a scene's objects into a few classes by what shading them takes. Each class gets kernels specialised for it
// (shared/features.h): on a device that runs every branch, lavapipe before Mesa 24 above all, the many plain objects of
// a scene then don't pay for its few glasses and noise textures; on others, neighbouring lanes do more alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "shared/tables.h"

namespace hw {

struct ShadingClasses {
  std::vector<std::uint32_t> features{0};  // HW_FEATURE_* of each class, at most HW_MAX_SHADING_CLASSES, never none
  std::uint32_t all = 0;                   // of everything: for kernels that know no class

  // The first class that has all of `features` (one of those the classes were chosen for).
  std::uint32_t class_of(std::uint32_t needs) const;
};

// `objects`: features needed by an object -> how many objects need exactly those.
ShadingClasses choose_shading_classes(const std::map<std::uint32_t, std::size_t>& objects);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Images from arrays of pixels.
#pragma once

#include <nanobind/nanobind.h>

#include <string>

#include "scene/scene.h"

namespace hw::python {

// Size, format and texels of an image from an (H, W), (H, W, 1), (H, W, 3) or (H, W, 4) array of uint8, float16 or
// float32, bottom row first; None: a missing image. TypeError or ValueError that starts with `label`. lend: texels that
// need no conversion stay in the array, which is kept.
ImageData take_image(nanobind::handle pixels, const std::string& label, bool lend);

}  // namespace hw::python

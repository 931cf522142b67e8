// SPDX-License-Identifier: Apache-2.0
// The Python module headwater._core.
#include "python/bind.h"

NB_MODULE(_core, m) {
  m.doc() =
      "Headwater's core: scene edits, rendering on a Vulkan device, pixels out.\n\n"
      "World space is right-handed, Z up, metres; matrices are row-major 3x4, object to world; colours are linear\n"
      "Rec. 709. Images and pixels have their bottom row first. Arrays are C-contiguous and are not converted.";
  hw::python::bind_errors(m);
  hw::python::bind_constants(m);
  hw::python::bind_scene(m);
  hw::python::bind_session(m);
  hw::python::bind_image_files(m);
  hw::python::bind_exit();
  hw::python::bind_versions(m);
  hw::python::bind_benchmark(m);
}

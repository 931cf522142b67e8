// SPDX-License-Identifier: Apache-2.0
// What this module was built with, for `headwater info` and bug reports.
#include <nanobind/stl/string.h>
#include <volk.h>

#include <string>

#include "python/bind.h"
#include "trace/embree_api.h"

namespace hw::python {

namespace {

nb::dict versions() {
  nb::dict d;
  d["Embree"] = RTC_VERSION_STRING;
  d["Vulkan headers"] = std::to_string(VK_API_VERSION_MAJOR(VK_HEADER_VERSION_COMPLETE)) + "." +
                        std::to_string(VK_API_VERSION_MINOR(VK_HEADER_VERSION_COMPLETE)) + "." +
                        std::to_string(VK_API_VERSION_PATCH(VK_HEADER_VERSION_COMPLETE));
#if defined(__clang__)
  d["compiler"] = "Clang " __clang_version__;
#elif defined(__GNUC__)
  d["compiler"] = "GCC " __VERSION__;
#else
  d["compiler"] = "unknown";
#endif
  d["build"] = HEADWATER_BUILD_TYPE;
  return d;
}

}  // namespace

void bind_versions(nb::module_& m) {
  m.def("versions", &versions,
        "What the module was built with: Embree, Vulkan headers, compiler, build (CMake's build type).");
}

}  // namespace hw::python

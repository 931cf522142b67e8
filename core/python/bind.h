// SPDX-License-Identifier: Apache-2.0
// The parts of the Python module headwater._core.
#pragma once

#include <nanobind/nanobind.h>

#include <memory>
#include <string>

namespace hw {
struct Context;
class Scene;
}  // namespace hw

namespace hw::python {

namespace nb = nanobind;

void bind_errors(nb::module_& m);     // SceneError, DeviceError and its kinds
void bind_constants(nb::module_& m);  // flags, material_ops
void bind_scene(nb::module_& m);
void bind_lights(nb::class_<Scene>& scene);  // lamps, a part of it
void bind_session(nb::module_& m);           // Context, Session, devices()
void bind_versions(nb::module_& m);
void bind_benchmark(nb::module_& m);    // tracer_benchmark()
void bind_image_files(nb::module_& m);  // ImageDecoder
void bind_exit();                       // ends what runs when the interpreter ends
void close_at_exit(const std::shared_ptr<Context>& context);

}  // namespace hw::python

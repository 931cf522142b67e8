// SPDX-License-Identifier: Apache-2.0
// Names and numbers that callers share with the core: errors, flags, opcodes.
#include "gpu/device.h"
#include "python/bind.h"
#include "scene/scene.h"
#include "shared/features.h"
#include "shared/material_program.h"

namespace hw::python {

void bind_errors(nb::module_& m) {
  nb::exception<SceneError>(m, "SceneError", PyExc_ValueError).doc() =
      "Scene data was refused; the message names the object and the reason, and the scene is as it was.";
  auto device_error = nb::exception<DeviceError>(m, "DeviceError", PyExc_RuntimeError);
  device_error.doc() = "The device can't do what was asked.";
  nb::exception<DeviceLost>(m, "DeviceLost", device_error).doc() = "The device stopped working; make a new Context.";
  nb::exception<OutOfMemory>(m, "OutOfMemory", device_error).doc() = "Device or host memory does not suffice.";
}

void bind_constants(nb::module_& m) {
  nb::dict flags;
#define HW_FLAG(name) flags[#name] = static_cast<std::uint32_t>(name)
  HW_FLAG(HW_NONE);
  HW_FLAG(HW_DOMAIN_VERTEX), HW_FLAG(HW_DOMAIN_CORNER), HW_FLAG(HW_DOMAIN_FACE), HW_FLAG(HW_MAX_ATTRIBUTES);
  HW_FLAG(HW_MASK_CAMERA), HW_FLAG(HW_MASK_DIFFUSE), HW_FLAG(HW_MASK_GLOSSY), HW_FLAG(HW_MASK_TRANSMISSION);
  HW_FLAG(HW_MASK_SHADOW_OPAQUE), HW_FLAG(HW_MASK_SHADOW_TRANSPARENT), HW_FLAG(HW_MASK_LAMP), HW_FLAG(HW_MASK_VOLUME);
  HW_FLAG(HW_INSTANCE_MIRRORED), HW_FLAG(HW_INSTANCE_HOLDOUT), HW_FLAG(HW_INSTANCE_SHADOW_CATCHER);
  HW_FLAG(HW_MATERIAL_EMISSIVE), HW_FLAG(HW_MATERIAL_EMISSION_SHADER), HW_FLAG(HW_MATERIAL_TRANSPARENT);
  HW_FLAG(HW_MATERIAL_NO_MIS), HW_FLAG(HW_MATERIAL_EMIT_FRONT), HW_FLAG(HW_MATERIAL_EMIT_BACK);
  HW_FLAG(HW_MATERIAL_BUMP_CORRECTION);
  HW_FLAG(HW_MATERIAL_UNEVEN);
  HW_FLAG(HW_IMAGE_SRGB), HW_FLAG(HW_IMAGE_PREMULTIPLIED);
  HW_FLAG(HW_LIGHT_CAST_SHADOW), HW_FLAG(HW_LIGHT_USE_MIS), HW_FLAG(HW_LIGHT_ELLIPSE), HW_FLAG(HW_LIGHT_CAMERA);
  HW_FLAG(HW_LIGHT_DIFFUSE), HW_FLAG(HW_LIGHT_GLOSSY), HW_FLAG(HW_LIGHT_TRANSMISSION), HW_FLAG(HW_LIGHT_SHADER);
  HW_FLAG(HW_LIGHT_TWO_SIDED), HW_FLAG(HW_LIGHT_SOFT_FALLOFF);
#undef HW_FLAG
  m.attr("flags") = flags;

  nb::dict ops;
#define HW_OP_ENTRY(name, code, operands, features) ops[#name] = static_cast<std::uint32_t>(code);
  HW_MATERIAL_OPS(HW_OP_ENTRY)
#undef HW_OP_ENTRY
  m.attr("material_ops") = ops;
}

}  // namespace hw::python

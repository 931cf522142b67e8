// SPDX-License-Identifier: Apache-2.0
// Tracer on the device through VK_KHR_acceleration_structure and VK_KHR_ray_tracing_pipeline.
#pragma once

#include <memory>

#include "trace/tracer.h"

namespace hw {

// Throws DeviceError when the device has no ray tracing pipelines.
std::unique_ptr<Tracer> make_ray_pipeline_tracer(Device& device);

}  // namespace hw

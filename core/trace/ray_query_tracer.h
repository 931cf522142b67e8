// SPDX-License-Identifier: Apache-2.0
// Tracer on the device through VK_KHR_acceleration_structure and VK_KHR_ray_query.
#pragma once

#include <memory>

#include "trace/tracer.h"

namespace hw {

// Throws DeviceError when the device has no ray query.
std::unique_ptr<Tracer> make_ray_query_tracer(Device& device);

}  // namespace hw

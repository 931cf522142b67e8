// SPDX-License-Identifier: Apache-2.0
// Lamps as Embree user geometry: primitive i is lamps[i].
#pragma once

#include <vector>

#include "shared/lights.h"
#include "trace/embree_api.h"

namespace hw {

// `lamps` must outlive the scene. Rays without HW_MASK_LAMP don't hit it.
void attach_lamps(RTCDevice device, RTCScene scene, const std::vector<LampShape>& lamps);

}  // namespace hw

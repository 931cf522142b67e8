// SPDX-License-Identifier: Apache-2.0
// Chooses a Tracer for a device.

#include "trace/tracer.h"

#include "trace/embree_tracer.h"

namespace hw {

std::unique_ptr<Tracer> make_tracer(Device& device, const std::string& kind, int threads) {
  if (kind == "embree" || kind == "auto") return make_embree_tracer(device, threads);
  throw DeviceError("There is no tracer \"" + kind + "\": it is one of auto, ray_query, embree.");
}

}  // namespace hw

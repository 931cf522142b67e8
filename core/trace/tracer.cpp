// SPDX-License-Identifier: Apache-2.0
// Chooses a Tracer for a device.

#include "trace/tracer.h"

#include "trace/embree_tracer.h"
#include "trace/ray_query_tracer.h"

namespace hw {

std::unique_ptr<Tracer> make_tracer(Device& device, const std::string& kind, int threads) {
  if (threads < 0) throw DeviceError("The number of threads can't be negative (" + std::to_string(threads) + ").");
  if (kind == "ray_query") return make_ray_query_tracer(device);
  if (kind == "embree") return make_embree_tracer(device, threads);
  if (kind == "auto") {
    // On a CPU device ray query runs in lavapipe, many times slower than Embree.
    if (device.info().ray_query && device.info().kind != "cpu") return make_ray_query_tracer(device);
    return make_embree_tracer(device, threads);
  }
  throw DeviceError("There is no tracer \"" + kind + "\": it is one of auto, ray_query, embree.");
}

}  // namespace hw

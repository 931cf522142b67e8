// SPDX-License-Identifier: Apache-2.0
// Chooses a Tracer for a device.

#include "trace/tracer.h"

#include "trace/embree_tracer.h"
#include "trace/ray_pipeline_tracer.h"
#include "trace/ray_query_tracer.h"

namespace hw {

const char* best_tracer(const DeviceInfo& info) {
  // On a CPU device rays run in lavapipe, many times slower than in Embree.
  if (info.kind == "cpu") return "embree";
  if (info.ray_query) return "ray_query";
  return info.ray_pipeline ? "ray_pipeline" : "embree";
}

std::unique_ptr<Tracer> make_tracer(Device& device, const std::string& kind, int threads) {
  if (threads < 0) throw DeviceError("The number of threads can't be negative (" + std::to_string(threads) + ").");
  const std::string chosen = kind == "auto" ? best_tracer(device.info()) : kind;
  if (chosen == "ray_query") return make_ray_query_tracer(device);
  if (chosen == "ray_pipeline") return make_ray_pipeline_tracer(device);
  if (chosen == "embree") return make_embree_tracer(device, threads);
  throw DeviceError("There is no tracer \"" + kind + "\": it is one of auto, ray_query, ray_pipeline, embree.");
}

}  // namespace hw

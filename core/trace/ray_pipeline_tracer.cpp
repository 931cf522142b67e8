// SPDX-License-Identifier: Apache-2.0
// Rays by ray tracing pipelines: one ray generation shader for nearest hits, one for any hit, over the queue of rays
// that ray query takes too. Hit group 0 is triangles, hit group 1 lamps (device_tracer.cpp): shaders/stages/pipeline_*.

#include "trace/ray_pipeline_tracer.h"

#include "trace/device_tracer.h"

namespace hw {
namespace {

class RayPipelineTracer final : public DeviceTracer {
 public:
  explicit RayPipelineTracer(Device& device)
      : DeviceTracer(device),
        closest_(device, "trace_closest",
                 {.generation = "pipeline_closest_rgen",
                  .miss = "pipeline_closest_rmiss",
                  .closest_hit = "pipeline_closest_rchit",
                  .intersection = "pipeline_lamps_rint"}),
        any_(device, "trace_any",
             {.generation = "pipeline_any_rgen",
              .miss = "pipeline_any_rmiss",
              .closest_hit = {},
              .intersection = "pipeline_lamps_rint"}) {}

  const char* name() const override { return "ray_pipeline"; }
  void closest(Commands& commands, const TraceArgs& args) override { trace(commands, args, closest_); }
  void any(Commands& commands, const TraceArgs& args) override { trace(commands, args, any_); }

 private:
  void trace(Commands& commands, const TraceArgs& args, const RayPipeline& pipeline) {
    const Push constants = push(args);
    commands.begin_stage(pipeline.name());
    commands.trace_rays(pipeline, constants.bytes(), *args.queue, args.capacity);
  }

  RayPipeline closest_, any_;
};

}  // namespace

std::unique_ptr<Tracer> make_ray_pipeline_tracer(Device& device) {
  if (!device.info().ray_pipeline)
    throw DeviceError("The tracer ray_pipeline can't run on " + device.info().name + " (" + device.info().driver +
                      "): " + device.info().ray_pipeline_why_not + " Use another tracer, or a newer driver.");
  return std::make_unique<RayPipelineTracer>(device);
}

}  // namespace hw

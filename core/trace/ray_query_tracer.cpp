// SPDX-License-Identifier: Apache-2.0
// Rays by ray query in compute kernels: shaders/stages/trace_closest.comp and trace_any.comp.

#include "trace/ray_query_tracer.h"

#include "trace/device_tracer.h"

namespace hw {
namespace {

class RayQueryTracer final : public DeviceTracer {
 public:
  explicit RayQueryTracer(Device& device)
      : DeviceTracer(device), closest_(device, "trace_closest"), any_(device, "trace_any") {}

  const char* name() const override { return "ray_query"; }
  void closest(Commands& commands, const TraceArgs& args) override { trace(commands, args, closest_); }
  void any(Commands& commands, const TraceArgs& args) override { trace(commands, args, any_); }

 private:
  void trace(Commands& commands, const TraceArgs& args, const Kernel& kernel) {
    const Push constants = push(args);
    commands.begin_stage(kernel.name());
    commands.dispatch_indirect(kernel, constants.bytes(), *args.queue);
  }

  Kernel closest_, any_;
};

}  // namespace

std::unique_ptr<Tracer> make_ray_query_tracer(Device& device) {
  if (!device.info().ray_query)
    throw DeviceError("The tracer ray_query can't run on " + device.info().name + " (" + device.info().driver +
                      "): " + device.info().ray_query_why_not + " Use another tracer, or a newer driver.");
  return std::make_unique<RayQueryTracer>(device);
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// ReSTIR as a list of stages, in the place of path's light sample:
//   surface → light candidates (→ trace shadow: visibility of candidates) → screen reuse → shade …
// One sample of every pixel is a pass; it reads the last pass's reservoirs and writes its own. The first pass of a
// render without history is preceded by one that fills the reservoirs, so that it has neighbours too.
#include "integrators/restir.h"

namespace hw {

RestirIntegrator::RestirIntegrator(const IntegratorContext& context, bool reproject)
    : context_(context),
      params_(resolve_reuse(context.settings)),
      reproject_(reproject),
      stages_(context, LightSource::kReservoir),
      buffers_(context.device, context.wave.capacity(), context.light_count, false),
      candidates_(context.kernels.get("light_candidates", context.constants)),
      reuse_(context.kernels.get(params_.unbiased ? "screen_merge" : "screen_reuse",
                                 with_weights(context.constants, params_.weights))) {}

void RestirIntegrator::begin_frame(Commands& commands) {
  ReservoirStore& store = context_.reservoirs;
  const auto& region = context_.settings.region;
  const std::string kind = context_.settings.integrator + " " + std::to_string(region[0]) + " " +
                           std::to_string(region[1]) + (params_.unbiased ? " unbiased" : "");
  const bool keeps = params_.unbiased ? keeps_valid_history(context_, kind) : keeps_history(context_, kind);
  if (!keeps || !store.screen || !store.screen->fits(context_.width, context_.height)) {
    store.clear();
    store.screen = std::make_unique<ScreenReservoirs>(context_.device, context_.width, context_.height);
    store.kind = kind;
    store.passes = context_.settings.first_sample;
  }
  ReuseFrame& frame = context_.wave.params().reuse;
  apply_reuse(frame, params_, context_.settings.width, context_.settings.height);
  buffers_.fill(frame);
  buffers_.follow_lights(context_.device, frame, context_.light_changes);
  if (reproject_) frame.flags |= HW_REUSE_REPROJECT;
  frame.pass = store.passes;
  if (store.screen->has_history) frame.flags |= HW_REUSE_HISTORY;
  if (store.screen->has_history && !context_.settings.resume) frame.flags |= HW_REUSE_NEW_FRAME;
  store.screen->fill(frame);
  context_.wave.write_params(commands);
  make_light_proxies(commands, context_);
  if (store.screen->has_history) {
    commands.begin_stage("reuse");
    dispatch_all(commands, context_.device, context_.kernels.get("screen_begin", context_.constants),
                 store.screen->pixels());
  }
}

int RestirIntegrator::preparations() const { return context_.reservoirs.screen->has_history ? 0 : 1; }

void RestirIntegrator::begin_pass(Commands& commands) {
  context_.reservoirs.screen->begin_pass(commands);
  context_.reservoirs.screen->fill(context_.wave.params().reuse);
}

void RestirIntegrator::end_pass(Commands&, int) {
  ScreenReservoirs& screen = *context_.reservoirs.screen;
  screen.end_pass();
  screen.has_history = true;
  ReuseFrame& frame = context_.wave.params().reuse;
  frame.flags = (frame.flags | HW_REUSE_HISTORY) & ~HW_REUSE_NEW_FRAME;
  frame.pass = ++context_.reservoirs.passes;
}

void RestirIntegrator::resample(Commands& commands, std::size_t c) {
  Queue& surfaces = stages_.surfaces(c);
  commands.begin_stage("candidates");
  if (params_.visibility_reuse) {
    stages_.prepare(commands, nullptr, RayKind::kNone, buffers_.visible.get());
    stages_.dispatch(commands, candidates_, surfaces, {.out_queue = buffers_.visible->address()});
    stages_.prepare(commands, buffers_.visible.get(), RayKind::kShadow, nullptr);
    context_.tracer.any(commands, {&buffers_.visible->buffer, context_.wave.shadow_rays.get(),
                                   context_.wave.shadow_hits.get(), context_.wave.capacity()});
  } else {
    stages_.dispatch(commands, candidates_, surfaces);
  }
  commands.begin_stage("reuse");
  stages_.dispatch(commands, reuse_, surfaces);
}

bool RestirIntegrator::prepare(Commands& commands, int) {
  return stages_.first_surfaces(commands, [&](std::size_t c) { resample(commands, c); });
}

bool RestirIntegrator::render(Commands& commands) {
  return stages_.render(commands, [&](std::size_t c) { resample(commands, c); });
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Path tracing as a list of stages:
//   camera → trace → [ sort hits → escaped, surface → shade → light program → trace shadow (→ shadow surface)* →
//   resolve → trace ]*
// `escaped` takes what lies behind everything and lamps; `surface` turns hits into closures and takes emission; `shade`
// samples a light and the BSDF; `resolve` adds the light samples that arrived. `surface` and `shade` run once for each
// class of objects (scene/shading_classes.h); `light program` only where a light's emission is a program. Paths stay in
// place, queues of path ids shrink as paths end.
#include "integrators/path.h"

#include <algorithm>
#include <utility>

#include "shared/features.h"
#include "shared/material_program.h"

namespace hw {

namespace {

enum Counter : std::uint32_t { kCamera = 0, kIndirect = 1, kShadow = 2, kTransparentShadow = 3, kNone = 4 };

// A device with its own memory is asked whether paths are left only this often: each question is a wait.
constexpr int kDeviceStride = 8;

// Kernels with parts that few scenes need come in two variants; see the top of material_vm.glsl.
const Kernel& variant(const IntegratorContext& context, const char* plain, const char* full, std::uint32_t needs,
                      const SpecConstants& constants) {
  return context.kernels.get((features_of(constants) & needs) ? full : plain, constants);
}
constexpr std::uint32_t kPrograms = HW_FEATURE_WORLD_PROGRAM | HW_FEATURE_EMISSION_PROGRAM;
constexpr std::uint32_t kProcedural = (HW_VM_NOISE | HW_VM_VORONOI | HW_VM_PATTERN) << HW_FEATURE_VM_SHIFT;

}  // namespace

PathIntegrator::PathIntegrator(const IntegratorContext& context)
    : context_(context),
      camera_(context.kernels.get("camera", context.constants)),
      sort_(context.kernels.get("sort_hits", context.constants)),
      escaped_(variant(context, "escaped", "escaped_programs", HW_FEATURE_WORLD_PROGRAM, context.constants)),
      resolve_(context.kernels.get("resolve", context.constants)),
      prepare_(context.kernels.get("queue_prepare")) {
  for (const SpecConstants& constants : context.class_constants) {
    surface_.push_back(&variant(context, "surface", "surface_procedural", kProcedural, constants));
    shade_.push_back(&context.kernels.get("shade", constants));
  }
  if (features_of(context.constants) & kPrograms)
    light_program_ = &context.kernels.get("light_program", context.constants);
  if (context.transparent_shadows) {
    shadow_begin_ = &context.kernels.get("shadow_begin", context.constants);
    shadow_surface_ = &variant(context, "shadow_surface", "shadow_surface_procedural", kProcedural, context.constants);
  }
}

void PathIntegrator::prepare(Commands& commands, Queue* queue, std::uint32_t counter, Queue* clear, Queue* clear2) {
  Push push{.queue = queue ? queue->address() : 0,
            .out_queue = clear ? clear->address() : 0,
            .out_queue2 = clear2 ? clear2->address() : 0,
            .a = counter};
  commands.dispatch(prepare_, push.bytes(), 1);
}

std::uint32_t PathIntegrator::count(Commands& commands, Queue& queue) {
  commands.flush();
  QueueHeader header{};
  context_.device.read(queue.buffer, 0, std::as_writable_bytes(std::span(&header, 1)));
  return header.count;
}

// Follows shadow rays that no opaque surface stops through transparent ones, one surface a round.
bool PathIntegrator::trace_transparent_shadows(Commands& commands) {
  Wave& w = context_.wave;
  prepare(commands, nullptr, kNone, w.shadow_next.get());
  Push begin{.queue = w.shadow_queue->address(), .out_queue = w.shadow_next->address()};
  commands.dispatch_indirect(*shadow_begin_, begin.bytes(), w.shadow_queue->buffer);
  prepare(commands, w.shadow_next.get(), kTransparentShadow, w.shadow_queue.get());
  std::swap(w.shadow_queue, w.shadow_next);
  const std::uint32_t rounds = context_.settings.transparent_bounces + 1;
  for (std::uint32_t round = 0; round <= rounds; ++round) {
    context_.tracer.closest(commands,
                            {&w.shadow_queue->buffer, w.shadow_rays.get(), w.shadow_surface_hits.get(), w.capacity()});
    commands.begin_stage("shadow surface");
    Push push{.queue = w.shadow_queue->address(), .out_queue = w.shadow_next->address()};
    commands.dispatch_indirect(*shadow_surface_, push.bytes(), w.shadow_queue->buffer);
    prepare(commands, w.shadow_next.get(), kTransparentShadow, w.shadow_queue.get());
    std::swap(w.shadow_queue, w.shadow_next);
    const bool ask = context_.device.shared_memory() || round % kDeviceStride == kDeviceStride - 1;
    if (ask && count(commands, *w.shadow_queue) == 0) break;
    if (context_.cancelled) return false;
  }
  return true;
}

bool PathIntegrator::render(Commands& commands) {
  Wave& w = context_.wave;
  Tracer& tracer = context_.tracer;
  const std::uint32_t paths = w.params().wave_pixels * w.params().wave_samples;

  commands.begin_stage("camera");
  for (auto& queue : w.hit_queues) prepare(commands, nullptr, kNone, queue.get());
  prepare(commands, nullptr, kNone, w.escaped_queue.get(), w.shadow_queue.get());
  Push push{.out_queue = w.active->address()};
  commands.dispatch(camera_, push.bytes(), (paths + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE);
  prepare(commands, w.active.get(), kCamera, w.next.get());
  tracer.closest(commands, {&w.active->buffer, w.rays.get(), w.hits.get(), w.capacity()});

  for (int step = 0;; ++step) {
    if (context_.cancelled) return false;
    commands.begin_stage("sort hits");
    push = {.queue = w.active->address(), .out_queue = w.escaped_queue->address()};
    commands.dispatch_indirect(sort_, push.bytes(), w.active->buffer);
    prepare(commands, w.escaped_queue.get(), kNone, w.program_queue.get());
    commands.begin_stage("escaped");
    push = {.queue = w.escaped_queue->address(), .out_queue2 = w.next->address()};
    commands.dispatch_indirect(escaped_, push.bytes(), w.escaped_queue->buffer);
    for (std::size_t c = 0; c < surface_.size(); ++c) {
      Queue &hits = *w.hit_queues[c], &surfaces = *w.surface_queues[c];
      commands.begin_stage("surface");
      prepare(commands, &hits, kNone, &surfaces);
      push = {.queue = hits.address(), .out_queue = surfaces.address()};
      commands.dispatch_indirect(*surface_[c], push.bytes(), hits.buffer);
      commands.begin_stage("shade");
      prepare(commands, &surfaces, kNone, nullptr);
      push = {.queue = surfaces.address(), .out_queue = w.shadow_queue->address(), .out_queue2 = w.next->address()};
      commands.dispatch_indirect(*shade_[c], push.bytes(), surfaces.buffer);
    }
    if (light_program_) {
      commands.begin_stage("light program");
      prepare(commands, w.program_queue.get(), kNone, nullptr);
      push = {.queue = w.program_queue->address()};
      commands.dispatch_indirect(*light_program_, push.bytes(), w.program_queue->buffer);
    }
    prepare(commands, w.shadow_queue.get(), kShadow, w.active.get(), nullptr);
    prepare(commands, w.next.get(), kIndirect, nullptr);

    const TraceArgs shadow{&w.shadow_queue->buffer, w.shadow_rays.get(), w.shadow_hits.get(), w.capacity()};
    tracer.any(commands, shadow);
    tracer.closest(commands, {&w.next->buffer, w.rays.get(), w.hits.get(), w.capacity()});

    // Shadow results are taken while the queue still lists every shadow ray of this step.
    commands.begin_stage("resolve");
    if (shadow_surface_) {
      // The transparent rounds shrink the queue: what arrived is added when a ray leaves it (shadow_surface.comp).
      if (!trace_transparent_shadows(commands)) return false;
    } else {
      push = {.queue = w.shadow_queue->address()};
      commands.dispatch_indirect(resolve_, push.bytes(), w.shadow_queue->buffer);
    }
    for (auto& queue : w.hit_queues) prepare(commands, nullptr, kNone, queue.get());
    prepare(commands, nullptr, kNone, w.escaped_queue.get(), w.shadow_queue.get());
    std::swap(w.active, w.next);

    const bool ask = context_.device.shared_memory() || step % kDeviceStride == kDeviceStride - 1;
    if (ask && count(commands, *w.active) == 0) return true;
  }
}

}  // namespace hw

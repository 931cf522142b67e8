// SPDX-License-Identifier: Apache-2.0
// Kernels, queues and dispatches of the shared stages.
#include "integrators/path_stages.h"

#include <algorithm>
#include <utility>

#include "shared/features.h"
#include "shared/material_program.h"

namespace hw {

namespace {

// Steps recorded without asking the device whether paths are left. What is recorded in vain are dispatches of no
// groups: they cost little beside a wait (docs/measurements/tracer.md). Most settings bound paths below it.
constexpr std::uint32_t kBlindSteps = 32;
// Rows of a host Tracer's queues that lie in the device's own memory are looked at this often: each look is a copy.
constexpr std::uint32_t kHostStride = 8;

// Steps after which every path has ended: a ray for each bounce, for the one past the last that only finds emission,
// for each transparent surface or lamp on the way and for the one past their limit, and the camera's. 0: no bound (a
// path counts its bounces up to 255).
std::uint32_t most_steps(const FrameParams& p) {
  const std::uint64_t steps = std::uint64_t(p.max_bounces) + p.max_transparent + 3;
  return p.max_bounces < 255 && steps < (1u << 30) ? static_cast<std::uint32_t>(steps) : 0;
}

constexpr std::uint32_t kPathReuse = 4;  // id of the constant HW_PATH_REUSE
std::uint32_t constant_of(const SpecConstants& constants, std::uint32_t id) {
  for (const auto& [key, value] : constants)
    if (key == id) return value;
  return 0;
}

// Kernels with parts that few scenes need come in two variants; see the top of material_vm.glsl.
const Kernel& variant(const IntegratorContext& context, const char* plain, const char* full, std::uint32_t needs,
                      const SpecConstants& constants) {
  return context.kernels.get((features_of(constants) & needs) ? full : plain, constants);
}
constexpr std::uint32_t kPrograms = HW_FEATURE_WORLD_PROGRAM | HW_FEATURE_EMISSION_PROGRAM;
constexpr std::uint32_t kProcedural = (HW_VM_NOISE | HW_VM_VORONOI | HW_VM_PATTERN) << HW_FEATURE_VM_SHIFT;

}  // namespace

bool keeps_history(const IntegratorContext& context, const std::string& kind) {
  // A lamp that goes further at once shines on places that could hardly have chosen it where it was.
  const float jump = 0.02f * context.scene_radius;
  return context.settings.continue_history && context.reservoirs.kind == kind && !context.light_changes.brightened &&
         context.light_changes.moved <= jump;
}

bool keeps_valid_history(const IntegratorContext& context, const std::string& kind) {
  return keeps_history(context, kind) && !context.light_changes.changed;
}

IntegratorContext with_path_reuse(IntegratorContext context, bool reuse) {
  const auto set = [&](SpecConstants& constants) {
    for (auto& [id, value] : constants)
      if (id == kPathReuse) value = reuse ? 1u : 0u;
  };
  set(context.constants);
  for (SpecConstants& constants : context.class_constants) set(constants);
  return context;
}

SpecConstants with_weights(SpecConstants constants, ReuseWeights weights) {
  constants.emplace_back(8, std::uint32_t(weights));
  return constants;
}

void dispatch_all(Commands& commands, Device& device, const Kernel& kernel, std::uint32_t count, std::uint32_t b,
                  std::uint64_t out) {
  const std::uint64_t most = std::uint64_t(device.max_groups()) * HW_GROUP_SIZE;
  for (std::uint64_t first = 0; first < count; first += most) {
    const Push push{.out_queue = out, .a = count, .b = b, .c = std::uint32_t(first)};
    const std::uint64_t threads = std::min<std::uint64_t>(most, count - first);
    commands.dispatch(kernel, push.bytes(), std::uint32_t((threads + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE));
  }
}

void append_first_surfaces(Commands& commands, const IntegratorContext& context, std::vector<vec3>& points) {
  commands.flush();
  const std::uint32_t count = context.wave.params().wave_pixels;
  std::vector<Ray> rays(count);
  std::vector<Hit> hits(count);
  context.device.read(*context.wave.rays, 0, std::as_writable_bytes(std::span(rays)));
  context.device.read(*context.wave.hits, 0, std::as_writable_bytes(std::span(hits)));
  for (std::uint32_t i = 0; i < count; ++i)
    if (hits[i].instance < HW_LAMP_INSTANCE) points.push_back(rays[i].origin + rays[i].direction * hits[i].t);
}

void make_light_proxies(Commands& commands, const IntegratorContext& context) {
  commands.begin_stage("light proxies");
  dispatch_all(commands, context.device, context.kernels.get("light_proxies"), context.light_count);
}

PathStages::PathStages(const IntegratorContext& context, LightSource source)
    : context_(context),
      camera_(context.kernels.get("camera", context.constants)),
      sort_(context.kernels.get("sort_hits", context.constants)),
      escaped_(variant(context, "escaped", "escaped_programs", HW_FEATURE_WORLD_PROGRAM, context.constants)),
      resolve_(context.kernels.get(source == LightSource::kCells ? "resolve_cells" : "resolve", context.constants)),
      prepare_(context.kernels.get("queue_prepare")) {
  for (const SpecConstants& constants : context.class_constants) {
    surface_.push_back(&variant(context, "surface", "surface_procedural", kProcedural, constants));
    shade_.push_back(&context.kernels.get(source == LightSource::kReservoir ? "shade_reservoir"
                                          : source == LightSource::kCells   ? "shade_cells"
                                                                            : "shade",
                                          constants));
  }
  if (samples_adaptively(context.settings)) camera_sampled_ = &context.kernels.get("camera_sampled", context.constants);
  if (constant_of(context.constants, kPathReuse)) reuse_.emplace(context);
  if (features_of(context.constants) & kPrograms)
    light_program_ = &context.kernels.get("light_program", context.constants);
  if (context.transparent_shadows) {
    shadow_begin_ = &context.kernels.get("shadow_begin", context.constants);
    shadow_surface_ = &variant(context, "shadow_surface", "shadow_surface_procedural", kProcedural, context.constants);
  }
}

void PathStages::prepare(Commands& commands, Queue* queue, RayKind kind, Queue* clear, Queue* clear2) {
  Push push{.queue = queue ? queue->address() : 0,
            .out_queue = clear ? clear->address() : 0,
            .out_queue2 = clear2 ? clear2->address() : 0,
            .a = std::uint32_t(kind)};
  commands.dispatch(prepare_, push.bytes(), 1);
}

void PathStages::dispatch(Commands& commands, const Kernel& kernel, Queue& queue, Push push) {
  push.queue = queue.address();
  commands.dispatch_indirect(kernel, push.bytes(), queue.buffer);
}

std::uint32_t PathStages::paths() const {
  const FrameParams& p = context_.wave.params();
  return p.wave_pixels * p.wave_samples;
}

bool PathStages::looks_after(std::uint32_t round) const {
  if (!context_.tracer.runs_on_host()) return round % kBlindSteps == kBlindSteps - 1;
  return context_.device.shared_memory() || round % kHostStride == kHostStride - 1;
}

void PathStages::camera(Commands& commands) {
  Wave& w = context_.wave;
  commands.begin_stage("camera");
  for (auto& queue : w.hit_queues) prepare(commands, nullptr, RayKind::kNone, queue.get());
  prepare(commands, nullptr, RayKind::kNone, w.escaped_queue.get(), w.shadow_queue.get());
  const Push push{.out_queue = w.active->address()};
  commands.dispatch(w.params().sampled_blocks ? *camera_sampled_ : camera_, push.bytes(),
                    (paths() * w.places() + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE);
  prepare(commands, w.active.get(), RayKind::kCamera, w.next.get());
  context_.tracer.closest(commands, {&w.active->buffer, w.rays.get(), w.hits.get(), w.capacity()});
}

void PathStages::sort_hits(Commands& commands) {
  Wave& w = context_.wave;
  commands.begin_stage("sort hits");
  dispatch(commands, sort_, *w.active, {.out_queue = w.escaped_queue->address()});
  prepare(commands, w.escaped_queue.get(), RayKind::kNone, w.program_queue.get());
  commands.begin_stage("escaped");
  dispatch(commands, escaped_, *w.escaped_queue, {.out_queue2 = w.next->address()});
}

void PathStages::surface(Commands& commands, std::size_t c) {
  Wave& w = context_.wave;
  Queue &hits = *w.hit_queues[c], &surfaces = *w.surface_queues[c];
  commands.begin_stage("surface");
  prepare(commands, &hits, RayKind::kNone, &surfaces);
  dispatch(commands, *surface_[c], hits, {.out_queue = surfaces.address()});
  prepare(commands, &surfaces, RayKind::kNone, nullptr);
}

void PathStages::shade(Commands& commands, std::size_t c, std::uint32_t light_samples) {
  Wave& w = context_.wave;
  commands.begin_stage("shade");
  dispatch(commands, *shade_[c], surfaces(c),
           {.out_queue = w.shadow_queue->address(),
            .out_queue2 = w.next->address(),
            .a = light_samples,
            .b = w.bounce_samples()});
}

bool PathStages::light(Commands& commands, std::uint32_t light_samples) {
  Wave& w = context_.wave;
  prepare(commands, w.next.get(), RayKind::kIndirect, w.active.get());
  context_.tracer.closest(commands, {&w.next->buffer, w.rays.get(), w.hits.get(), w.capacity()});
  if (!trace_shadows(commands)) return false;
  commands.begin_stage("resolve");
  for (std::size_t c = 0; c < classes(); ++c) dispatch(commands, resolve_, surfaces(c), {.a = light_samples});
  return true;
}

bool PathStages::trace_shadows(Commands& commands) {
  Wave& w = context_.wave;
  if (light_program_) {
    commands.begin_stage("light program");
    prepare(commands, w.program_queue.get(), RayKind::kNone, nullptr);
    dispatch(commands, *light_program_, *w.program_queue);
  }
  prepare(commands, w.shadow_queue.get(), RayKind::kShadow, nullptr);
  context_.tracer.any(commands,
                      {&w.shadow_queue->buffer, w.shadow_rays.get(), w.shadow_hits.get(), w.shadow_capacity()});
  return !shadow_surface_ || trace_transparent_shadows(commands);
}

bool PathStages::advance(Commands& commands, int step) {
  Wave& w = context_.wave;
  for (auto& queue : w.hit_queues) prepare(commands, nullptr, RayKind::kNone, queue.get());
  prepare(commands, nullptr, RayKind::kNone, w.escaped_queue.get(), w.shadow_queue.get());
  std::swap(w.active, w.next);
  const std::uint32_t done = static_cast<std::uint32_t>(step) + 1;
  bool look = looks_after(step);
  if (!context_.tracer.runs_on_host()) {
    w.pace.recorded(step, paths());
    look = look || w.pace.due();
    if (done == most_steps(w.params())) return false;
  }
  return !(look && w.count(commands, *w.active) == 0);
}

bool PathStages::render(Commands& commands, const std::function<void(std::size_t)>& resample) {
  camera(commands);
  for (int step = 0;; ++step) {
    if (context_.cancelled) return false;
    sort_hits(commands);
    for (std::size_t c = 0; c < classes(); ++c) {
      surface(commands, c);
      resample(c);
    }
    // Several at what the camera sees first, which is traced and shaded once for all of them.
    const std::uint32_t light_samples = step == 0 ? context_.wave.params().light_samples : 1;
    for (std::size_t c = 0; c < classes(); ++c) shade(commands, c, light_samples);
    if (after_shading) after_shading();
    if (!light(commands, light_samples)) return false;
    if (!advance(commands, step)) break;
  }
  if (reuse_ && shares && context_.wave.places() > context_.wave.bounce_samples()) reuse_->share(commands);
  return true;
}

bool PathStages::first_surfaces(Commands& commands, const std::function<void(std::size_t)>& resample) {
  if (context_.cancelled) return false;
  camera(commands);
  sort_hits(commands);
  for (std::size_t c = 0; c < classes(); ++c) {
    surface(commands, c);
    resample(c);
  }
  if (!context_.tracer.runs_on_host()) context_.wave.pace.recorded(0, paths());
  return true;
}

// Follows shadow rays that no opaque surface stops through transparent ones, one surface a round.
bool PathStages::trace_transparent_shadows(Commands& commands) {
  Wave& w = context_.wave;
  commands.begin_stage("shadow surface");
  prepare(commands, nullptr, RayKind::kNone, w.shadow_next.get());
  dispatch(commands, *shadow_begin_, *w.shadow_queue, {.out_queue = w.shadow_next->address()});
  prepare(commands, w.shadow_next.get(), RayKind::kTransparentShadow, w.shadow_queue.get());
  std::swap(w.shadow_queue, w.shadow_next);
  const std::uint32_t rounds = context_.settings.transparent_bounces + 1;
  for (std::uint32_t round = 0; round <= rounds; ++round) {
    context_.tracer.closest(
        commands, {&w.shadow_queue->buffer, w.shadow_rays.get(), w.shadow_surface_hits.get(), w.shadow_capacity()});
    commands.begin_stage("shadow surface");
    dispatch(commands, *shadow_surface_, *w.shadow_queue, {.out_queue = w.shadow_next->address()});
    prepare(commands, w.shadow_next.get(), RayKind::kTransparentShadow, w.shadow_queue.get());
    std::swap(w.shadow_queue, w.shadow_next);
    if (looks_after(round) && w.count(commands, *w.shadow_queue) == 0) break;
    if (context_.cancelled) return false;
  }
  return true;
}

}  // namespace hw

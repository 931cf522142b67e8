// SPDX-License-Identifier: Apache-2.0
// Wave buffers and the frame's parameters.
#include "stages/wave.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "lib/filter.h"

namespace hw {

namespace {

constexpr std::size_t kCountersSlot = 0, kQueueSlot = 64, kReadbackBytes = 128;  // offsets in the readback buffer
static_assert(sizeof(RayCounters) <= kQueueSlot && kQueueSlot + sizeof(QueueHeader) <= kReadbackBytes);
static_assert(sizeof(FrameParams) <= 65536 && sizeof(FrameParams) % 4 == 0);  // Commands::update()

}  // namespace

std::size_t wave_bytes_per_path(std::uint32_t light_samples, bool path_reuse, const FilmLayout& layout) {
  const std::size_t shadow = sizeof(Ray) + sizeof(Hit) + 4 + sizeof(ShadowState) + 3 * 4;
  return sizeof(PathState) + sizeof(Ray) + sizeof(Hit) + sizeof(SurfacePoint) + HW_MAX_CLOSURES * sizeof(Closure) +
         (layout.split_paths() ? sizeof(PathSplit) : 0) + layout.stride * 4 + (3 + 2 * HW_MAX_SHADING_CLASSES) * 4 +
         light_samples * shadow +
         (path_reuse ? sizeof(SharedVertex) + HW_REUSE_PIXELS * (sizeof(SharedPair) + sizeof(Ray) + 4 + 4) +
                           (layout.light_passes ? HW_REUSE_PIXELS * sizeof(vec3) : 0)
                     : 0);
}

std::unique_ptr<Buffer> Wave::make(Device& device, std::size_t element, const char* label) {
  const std::size_t bytes = std::max<std::size_t>(element * capacity_, 64);
  bytes_ += bytes;
  return std::make_unique<Buffer>(device, bytes, BufferUse::device, label);
}

Wave::Wave(Device& device, std::uint32_t capacity, std::uint32_t light_samples, bool path_reuse,
           const FilmLayout& layout)
    : capacity_(capacity), light_samples_(light_samples), layout_mask_(layout.mask) {
  paths = make(device, sizeof(PathState), "path states");
  rays = make(device, sizeof(Ray), "rays");
  hits = make(device, sizeof(Hit), "hits");
  shadow_rays = make(device, light_samples * sizeof(Ray), "shadow rays");
  shadow_hits = make(device, light_samples * 4, "shadow ray results");
  shadow_surface_hits = make(device, light_samples * sizeof(Hit), "shadow ray hits");
  shadows = make(device, light_samples * sizeof(ShadowState), "shadow states");
  surfaces = make(device, sizeof(SurfacePoint), "surface points");
  closures = make(device, sizeof(Closure) * HW_MAX_CLOSURES, "closures");
  splits = make(device, layout.split_paths() ? sizeof(PathSplit) : 0, "light pass shares");
  results = make(device, layout.stride * 4, "results");
  if (path_reuse) {
    shared_vertices = make(device, sizeof(SharedVertex), "shared vertices");
    shared_pairs = make(device, HW_REUSE_PIXELS * sizeof(SharedPair), "shared pairs");
    shared_shares = make(device, layout.light_passes ? HW_REUSE_PIXELS * sizeof(vec3) : 0, "shared light pass shares");
    shared_rays = make(device, HW_REUSE_PIXELS * sizeof(Ray), "rays between pixels' paths");
    shared_hits = make(device, HW_REUSE_PIXELS * 4, "results of rays between pixels' paths");
    shared_queue = std::make_unique<Queue>(device, capacity * HW_REUSE_PIXELS, "shared pair queue");
    bytes_ += std::size_t(capacity) * HW_REUSE_PIXELS * 4;
  }
  counters_buffer = std::make_unique<Buffer>(device, sizeof(RayCounters), BufferUse::device, "ray counters");
  frame = std::make_unique<Buffer>(device, sizeof(FrameParams), BufferUse::device, "frame parameters");
  readback_ = std::make_unique<Buffer>(device, kReadbackBytes, BufferUse::readback, "readback");
  std::memset(readback_->mapped(), 0, kReadbackBytes);
  active = std::make_unique<Queue>(device, capacity, "active queue");
  next = std::make_unique<Queue>(device, capacity, "next queue");
  for (std::uint32_t c = 0; c < HW_MAX_SHADING_CLASSES; ++c) {
    hit_queues[c] = std::make_unique<Queue>(device, capacity, "hit queue");
    surface_queues[c] = std::make_unique<Queue>(device, capacity, "surface queue");
    params_.hit_queues[c] = hit_queues[c]->address();
  }
  escaped_queue = std::make_unique<Queue>(device, capacity, "escaped queue");
  program_queue = std::make_unique<Queue>(device, shadow_capacity(), "light program queue");
  params_.program_queue = program_queue->address();
  shadow_queue = std::make_unique<Queue>(device, shadow_capacity(), "shadow queue");
  shadow_next = std::make_unique<Queue>(device, shadow_capacity(), "next shadow queue");
  Commands commands(device);
  for (Queue* q :
       {active.get(), next.get(), escaped_queue.get(), shadow_queue.get(), shadow_next.get(), program_queue.get()})
    commands.fill(q->buffer, 0, sizeof(QueueHeader), 0);
  for (std::uint32_t c = 0; c < HW_MAX_SHADING_CLASSES; ++c) {
    commands.fill(hit_queues[c]->buffer, 0, sizeof(QueueHeader), 0);
    commands.fill(surface_queues[c]->buffer, 0, sizeof(QueueHeader), 0);
  }
  if (shared_queue) commands.fill(shared_queue->buffer, 0, sizeof(QueueHeader), 0);
  commands.fill(*counters_buffer, 0, sizeof(RayCounters), 0);
  commands.flush();

  params_.light_samples = light_samples;
  set_bounce_samples(1, false);
  params_.pixels_a_path = 1;
  params_.paths = paths->address();
  params_.rays = rays->address();
  params_.hits = hits->address();
  params_.shadow_rays = shadow_rays->address();
  params_.shadow_hits = shadow_hits->address();
  params_.shadow_surface_hits = shadow_surface_hits->address();
  params_.shadows = shadows->address();
  params_.surfaces = surfaces->address();
  params_.closures = closures->address();
  params_.splits = splits->address();
  params_.results = results->address();
  if (path_reuse) {
    params_.shared_vertices = shared_vertices->address();
    params_.shared_pairs = shared_pairs->address();
    params_.shared_shares = shared_shares->address();
    params_.shared_rays = shared_rays->address();
    params_.shared_hits = shared_hits->address();
  }
  params_.counters = counters_buffer->address();
}

void Wave::write_params(Commands& commands) { commands.update(*frame, 0, std::as_bytes(std::span(&params_, 1))); }

// A struct at the start of `from` reaches the host with the flush that comes anyway, not by a submission of its own.
template <class T>
void Wave::bring(Commands& commands, const Buffer& from, std::size_t slot) {
  if (!from.mapped()) commands.copy(from, 0, *readback_, slot, sizeof(T));
}
template <class T>
T Wave::brought(const Buffer& from, std::size_t slot) const {
  T value{};
  std::memcpy(&value, from.mapped() ? from.as<std::byte>() : readback_->as<std::byte>() + slot, sizeof value);
  return value;
}

void Wave::reset_counters(Commands& commands) { commands.fill(*counters_buffer, 0, sizeof(RayCounters), 0); }
void Wave::record_counters(Commands& commands) { bring<RayCounters>(commands, *counters_buffer, kCountersSlot); }
RayCounters Wave::counters() const { return brought<RayCounters>(*counters_buffer, kCountersSlot); }

std::uint32_t Wave::count(Commands& commands, const Queue& queue) {
  bring<QueueHeader>(commands, queue.buffer, kQueueSlot);
  pace.submit(commands);
  return brought<QueueHeader>(queue.buffer, kQueueSlot).count;
}

void apply_settings(FrameParams& p, const RenderSettings& s, const FilmLayout& layout) {
  p.reuse.light_mis_scale = 1;
  p.width = s.width;
  p.height = s.height;
  p.region_x = s.region[0];
  p.region_y = s.region[1];
  p.region_width = s.region[2] - s.region[0];
  p.region_height = s.region[3] - s.region[1];
  p.seed = s.seed;
  p.passes = layout.mask;
  p.film_stride = layout.stride;
  p.film_pixel_stride = layout.pixel_stride();
  p.sampled_blocks = 0;
  std::copy(std::begin(layout.offset), std::end(layout.offset), std::begin(p.pass_offset));
  p.max_bounces = s.max_bounces;
  p.max_diffuse = s.diffuse_bounces;
  p.max_glossy = s.glossy_bounces;
  p.max_transmission = s.transmission_bounces;
  p.max_transparent = s.transparent_bounces;
  p.min_bounces = s.min_bounces;
  // Cycles bounds the sum of three channels by three times the setting.
  p.clamp_direct = s.clamp_direct > 0 ? 3 * s.clamp_direct : HW_INFINITY;
  p.clamp_indirect = s.clamp_indirect > 0 ? 3 * s.clamp_indirect : HW_INFINITY;
  p.filter_glossy = s.filter_glossy > 0 ? 1 / s.filter_glossy : HW_INFINITY;
  p.filter_type = s.filter == "BOX"        ? HW_FILTER_BOX
                  : s.filter == "GAUSSIAN" ? HW_FILTER_GAUSSIAN
                                           : HW_FILTER_BLACKMAN_HARRIS;
  p.filter_width = s.filter_width;
  p.caustics = (s.caustics_reflective ? 1u : 0u) | (s.caustics_refractive ? 2u : 0u);
  p.transparent_film = (s.transparent_film ? 1u : 0u) | (s.transparent_glass ? 2u : 0u);
  p.pass_alpha_threshold = s.pass_alpha_threshold;
  p.mist_start = s.mist_start;
  p.mist_inverse_depth = s.mist_depth > 0 ? 1 / s.mist_depth : 0;
  p.mist_falloff = s.mist_falloff == "LINEAR" ? 1.0f : s.mist_falloff == "INVERSE_QUADRATIC" ? 0.5f : 2.0f;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// The buffers of one wave of paths: state, rays, hits, closures, queues. Sized once for a render and used again by
// every wave of it.
#pragma once

#include <cstdint>
#include <memory>

#include "film/film.h"
#include "gpu/device.h"
#include "session/settings.h"
#include "shared/closure.h"
#include "shared/path.h"
#include "shared/tables.h"
#include "stages/pace.h"
#include "stages/stage.h"

namespace hw {

class Wave {
 public:
  // For `capacity` paths, each with places for so many shadow rays, and what path reuse needs if it is asked for.
  // Throws OutOfMemory when the buffers don't fit.
  Wave(Device& device, std::uint32_t capacity, std::uint32_t light_samples, bool path_reuse, const FilmLayout& layout);

  std::uint32_t capacity() const { return capacity_; }
  std::uint32_t light_samples() const { return light_samples_; }
  std::uint32_t bounce_samples() const { return params_.bounce_samples; }
  // So many paths go on from the first surface; with path reuse one place more stays at it.
  void set_bounce_samples(std::uint32_t count, bool reuse) {
    params_.bounce_samples = count;
    params_.places = count + (reuse ? 1 : 0);
  }
  std::uint32_t places() const { return params_.places; }
  bool path_reuse() const { return shared_queue != nullptr; }
  std::uint32_t shadow_capacity() const { return capacity_ * light_samples_; }
  std::uint64_t bytes() const { return bytes_; }
  // Parameters of the coming wave; write_params() puts them where the stages recorded after it read them.
  FrameParams& params() { return params_; }
  void write_params(Commands& commands);
  void reset_counters(Commands& commands);
  // Records what brings the counters to the host; counters() is what the last flush brought.
  void record_counters(Commands& commands);
  RayCounters counters() const;
  // How many paths `queue` lists: flushes `commands`.
  std::uint32_t count(Commands& commands, const Queue& queue);
  Pace pace;  // of devices that trace; kept between renders
  std::uint32_t layout_mask() const { return layout_mask_; }

  std::unique_ptr<Buffer> paths, rays, hits, shadow_rays, shadow_hits, shadow_surface_hits, shadows, surfaces, closures,
      splits, results, counters_buffer, frame, shared_vertices, shared_pairs, shared_shares, shared_rays, shared_hits;
  std::unique_ptr<Queue> active, next, hit_queues[HW_MAX_SHADING_CLASSES], escaped_queue,
      surface_queues[HW_MAX_SHADING_CLASSES], shadow_queue, shadow_next, program_queue,
      shared_queue;  // path reuse

 private:
  template <class T>
  void bring(Commands& commands, const Buffer& from, std::size_t slot);
  template <class T>
  T brought(const Buffer& from, std::size_t slot) const;

  std::unique_ptr<Buffer> readback_;  // mapped: what the host looks at of buffers that it can't see
  std::unique_ptr<Buffer> make(Device& device, std::size_t element, const char* label);
  std::uint32_t capacity_, light_samples_;
  std::uint32_t layout_mask_;  // passes the results were sized for
  std::uint64_t bytes_ = 0;
  FrameParams params_{};
};

// Bytes a path takes with this layout: what decides how many fit in a wave.
std::size_t wave_bytes_per_path(std::uint32_t light_samples, bool path_reuse, const FilmLayout& layout);

// Fills the parts of FrameParams that settings decide, but for the light samples, which are the wave's.
void apply_settings(FrameParams& params, const RenderSettings& settings, const FilmLayout& layout);

}  // namespace hw

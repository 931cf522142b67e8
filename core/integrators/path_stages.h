// SPDX-License-Identifier: Apache-2.0
// The wavefront stages that every integrator of light paths shares, each with its queues: camera, sorting of hits, what
// escaped, surfaces, shading, shadow rays. Follows Laine, Karras and Aila 2013.
// An integrator calls them in its own order and puts its own stages between surface() and shade().
#pragma once

#include <functional>
#include <optional>

#include "integrators/integrator.h"
#include "integrators/path_reuse.h"

namespace hw {

// What queue_prepare.comp does with a queue's count.
enum class RayKind : std::uint32_t { kCamera = 0, kIndirect = 1, kShadow = 2, kTransparentShadow = 3, kNone = 4 };

// Whether the reservoirs of the session's last render may go on in this one: it was asked for, they are of this `kind`,
// and no light came on or jumped since. Under 1/M weights samples that could not have found a light make it dark, and
// merging hands their number on from pixel to pixel: they fade over dozens of passes, so that they are dropped.
bool keeps_history(const IntegratorContext& context, const std::string& kind);

// The same for unbiased estimators: their MIS weights ask what could have been sampled when a sample was made, which
// only lights that are as they were can tell.
bool keeps_valid_history(const IntegratorContext& context, const std::string& kind);

// Merging by each kind of weights is a kernel of its own: drivers that run both sides of a branch pay for all of it.
SpecConstants with_weights(SpecConstants constants, ReuseWeights weights);

// One thread for each of `count` elements, in as many dispatches as the device needs: a is the count, c each dispatch's
// first element; `out`: address of what they fill.
void dispatch_all(Commands& commands, Device& device, const Kernel& kernel, std::uint32_t count, std::uint32_t b = 0,
                  std::uint64_t out = 0);

// The first surfaces of the wave's camera rays (world space), from rays and hits.
void append_first_surfaces(Commands& commands, const IntegratorContext& context, std::vector<vec3>& points);

// Runs light_proxies.comp: the lights as reuse sees them, for this frame. Parameters must have been written.
void make_light_proxies(Commands& commands, const IntegratorContext& context);

// The same scene and film with kernels of path reuse, or without.
IntegratorContext with_path_reuse(IntegratorContext context, bool reuse);

// Where shading has its light samples from (the variants of shade.comp).
enum class LightSource { kDrawn, kReservoir, kCells };

class PathStages {
 public:
  PathStages(const IntegratorContext& context, LightSource source);

  bool shares = true;                   // path reuse ends a wave that leaves places for it: not in preparations
  std::function<void()> after_shading;  // of all classes, in every step of render()

  // Starts the wave's paths, traces their camera rays.
  void camera(Commands& commands);
  // Sends hits to the queues of their shading classes, and shades what hit nothing or a lamp.
  void sort_hits(Commands& commands);
  std::size_t classes() const { return surface_.size(); }
  // Hits of a class become surfaces: material programs run, emission is taken.
  void surface(Commands& commands, std::size_t shading_class);
  Queue& surfaces(std::size_t shading_class) { return *context_.wave.surface_queues[shading_class]; }
  // Light samples and BSDF sample of every surface of a class. `light_samples`: of each, at most as many as the wave
  // has places for.
  void shade(Commands& commands, std::size_t shading_class, std::uint32_t light_samples);
  // Traces next rays and shadow rays, adds the light that arrived. False: cancelled.
  bool light(Commands& commands, std::uint32_t light_samples);
  // Makes the next rays the current ones. False: no path is left (`step` counts calls of a wave from 0). A Tracer on
  // the host is given a look at the queue after every step; on the device steps are recorded as far as paths can go,
  // and the host looks only where it submits anyway.
  bool advance(Commands& commands, int step);

  // The whole of a wave's paths, with `resample` run for each shading class between its surfaces and their shading.
  // False: cancelled.
  bool render(Commands& commands, const std::function<void(std::size_t)>& resample);
  // As far as the first surfaces and their `resample`: what prepares reservoirs. False: cancelled.
  bool first_surfaces(Commands& commands, const std::function<void(std::size_t)>& resample);

  // Turns a queue's count into dispatch arguments and a ray counter, and empties the queues that are filled next.
  void prepare(Commands& commands, Queue* queue, RayKind kind, Queue* clear, Queue* clear2 = nullptr);
  // One thread for each path of the queue.
  void dispatch(Commands& commands, const Kernel& kernel, Queue& queue, Push push = {});

 private:
  bool trace_shadows(Commands& commands);
  bool trace_transparent_shadows(Commands& commands);

  std::uint32_t paths() const;  // of the wave
  bool looks_after(std::uint32_t round) const;

  IntegratorContext context_;
  const Kernel& camera_;
  const Kernel* camera_sampled_ = nullptr;  // of the blocks that a pass samples
  const Kernel& sort_;
  const Kernel& escaped_;
  const Kernel& resolve_;
  const Kernel& prepare_;
  std::vector<const Kernel*> surface_, shade_;  // by class
  std::optional<PathReuse> reuse_;
  const Kernel* light_program_ = nullptr;  // only where lights' emission is a program
  const Kernel* shadow_begin_ = nullptr;   // these two only in scenes that let shadow rays through
  const Kernel* shadow_surface_ = nullptr;
};

}  // namespace hw

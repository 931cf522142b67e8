// SPDX-License-Identifier: Apache-2.0
// An integrator is an ordered list of wavefront stages over one wave of paths. A new one adds a file and a line in the
// registry (integrator.cpp).
//
// A pass is one sample of every pixel, in one or more waves. Reservoir integrators read what the last pass left and
// write for the next, so that waves of a pass may come in any order.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "reservoirs/reservoir_store.h"
#include "scene/light_identity.h"
#include "session/settings.h"
#include "stages/stage.h"
#include "stages/wave.h"
#include "trace/tracer.h"

namespace hw {

// What an integrator works with; everything outlives it.
struct IntegratorContext {
  Device& device;
  Tracer& tracer;
  KernelCache& kernels;
  Wave& wave;
  SpecConstants constants;                     // features of the scene, passes of the film
  std::vector<SpecConstants> class_constants;  // the same for each class of objects (scene/shading_classes.h)
  bool transparent_shadows;                    // some material lets shadow rays through
  RenderSettings settings;
  const std::atomic<bool>& cancelled;
  ReservoirStore& reservoirs;         // kept over frames
  std::uint32_t light_count;          // in the light table
  float light_power;                  // estimate of all they send out [W]
  LightChanges light_changes;         // since the last render of the session
  float scene_radius;                 // of a sphere about everything [m]
  vec3 camera_position;               // world space
  float pixel_size;                   // width of a pixel per metre of distance, or [m] where the camera is orthographic
  std::uint32_t width, height;        // of the region that is rendered, pixels
  int threads;                        // of the host, 0: all
  std::uint64_t light_tree_revision;  // another when nodes of the tree no longer hold the same lights
  std::uint64_t light_tree_fit;       // another when their bounds or power may have changed
  float light_tree_unit;              // what a power of 1 stands for there [W sr^-1]
};

// The value of constant 0, the features.
inline std::uint32_t features_of(const SpecConstants& constants) {
  return constants.empty() ? ~0u : constants.front().second;
}

class Integrator {
 public:
  virtual ~Integrator() = default;
  // Renders the wave that wave.params() describes, up to its results. False: cancelled on the way, results unusable.
  virtual bool render(Commands& commands) = 0;

  // Whether a wave may hold several samples of a pixel. Not where one sample reads what the last one left.
  virtual bool samples_are_independent() const { return true; }
  // Before the waves of a render: brings what is kept from the last frame to this one.
  virtual void begin_frame(Commands&) {}
  // The seed of this frame's random numbers, of the one that was given. Another where what is kept from earlier frames
  // decides how they are used, since it may have been learned from the very same numbers.
  virtual std::uint32_t seed(std::uint32_t given) const { return given; }
  // Passes over the picture that must come before the first sample: they leave reservoirs, no light. What one finds may
  // call for more.
  virtual int preparations() const { return 0; }
  // How many pixels such a pass has one path for.
  virtual std::uint32_t preparation_pixels() const { return 1; }
  // Preparations of the same set look at the same of them.
  virtual int preparation_set(int preparation) const { return preparation / 2; }
  virtual bool prepare(Commands&, int /*preparation*/) { return true; }  // one wave; false: cancelled
  // Around the waves of a pass, or of a preparation (then `preparation` is its number, else -1).
  virtual void begin_pass(Commands&) {}
  virtual void end_pass(Commands&, int /*preparation*/) {}
};

// By settings.integrator. Where reuse can't pay, with next to no lights, that is `path`, whatever the name.
std::unique_ptr<Integrator> make_integrator(const IntegratorContext& context);
// Whether samples go where noise is left: where that was asked for, of integrators that take pixels in any number and
// order.
bool samples_adaptively(const RenderSettings& settings);
// Whether it is `path`, with so many lights in the table.
bool renders_by_path(const RenderSettings& settings, std::uint32_t light_count);
// Light samples of what the camera sees first: as many as were asked for, else the integrator's default, but no more
// than there are lights: of one light, several cost more than they gain (docs/measurements/wssr_hash.md).
std::uint32_t light_samples(const RenderSettings& settings, std::uint32_t light_count);
// Whether pixels share what their paths find (path_reuse.h): where that was asked for, or is the integrator's way.
// `wssr-hash` finds that out; here whether it may.
bool reuses_paths(const RenderSettings& settings, std::uint32_t light_count);
// Paths that may go on from the first surface that scatters light, at most.
std::uint32_t most_bounce_samples(const RenderSettings& settings);

}  // namespace hw

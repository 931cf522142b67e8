// SPDX-License-Identifier: Apache-2.0
// An integrator is an ordered list of wavefront stages over one wave of paths. A new one adds a file and a line in the
// registry (integrator.cpp).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/device.h"
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
};

std::unique_ptr<Integrator> make_integrator(const IntegratorContext& context);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// The order of a render: kernels for this scene, waves over the picture, one sample after the other, until the samples,
// the time or the artist's patience run out.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "film/film.h"
#include "reservoirs/reservoir_store.h"
#include "scene/tables.h"
#include "session/adaptive_sampling.h"
#include "session/session.h"
#include "session/settings.h"
#include "stages/wave.h"

namespace hw {

class Integrator;

class RenderLoop {
 public:
  // `begun`: what the film holds already. `wave` is kept between renders and replaced when it does not fit;
  // `reservoirs` are kept where settings ask for it.
  RenderLoop(Context& context, Tracer& tracer, Tables& tables, Film& film, std::unique_ptr<Wave>& wave,
             ReservoirStore& reservoirs, const RenderSettings& settings, const SampleCounts& begun,
             const std::atomic<bool>& cancelled);
  void run();  // throws DeviceError and what integrators throw

  std::function<void(const SampleCounts&, const RayCounters&)> on_samples = [](auto&, auto&) {};
  std::function<void(const char*)> on_stage = [](auto) {};
  std::function<void()> on_idle = [] {};  // between waves: the film may be downloaded here

 private:
  void render();
  void choose_wave();
  // Evaluates what programs emit, for the odds of lights.
  // Of kernels with these HW_FEATURE_*, and what every kernel of this scene and film must hold.
  SpecConstants constants_for(std::uint32_t features) const;
  void measure_lights(Commands& commands);
  // Runs what is recorded, and says how far the picture is.
  void submit(Commands& commands);
  void report(const Commands& commands);
  // False: cancelled.
  bool passes(Commands& commands, Integrator& integrator, std::chrono::steady_clock::time_point begun);
  // One pass over `pixels` in waves of `per_wave` samples a pixel. `preparation`: its number, -1: samples. False:
  // cancelled.
  bool pass(Commands& commands, Integrator& integrator, std::uint32_t pixels, std::uint32_t per_wave, int preparation,
            SampleCounts& counts);

  Context& context_;
  Tracer& tracer_;
  Tables& tables_;
  Film& film_;
  std::unique_ptr<Wave>& wave_;
  ReservoirStore& reservoirs_;
  const RenderSettings& settings_;
  const SampleCounts begun_;
  const std::atomic<bool>& cancelled_;
  const Kernel* accumulate_ = nullptr;
  std::optional<AdaptiveSampling> adaptive_;  // where samples are not the same for all pixels

  struct Recorded {
    SampleCounts counts;
    std::uint64_t flushes;  // of the commands, when it was recorded
  };
  std::vector<Recorded> recorded_;  // samples on their way into the film: counted when they are there
  std::uint64_t film_flushes_ = 0;  // of the commands, when samples were last recorded
};

}  // namespace hw

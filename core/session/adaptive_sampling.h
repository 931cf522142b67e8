// SPDX-License-Identifier: Apache-2.0
// The device's side of adaptive sampling: brings each pass's blocks of the plan to the kernels, and tells the plan how
// noisy the film is.
#pragma once

#include "film/film.h"
#include "gpu/device.h"
#include "session/adaptive_plan.h"
#include "session/settings.h"
#include "stages/wave.h"

namespace hw {

class AdaptiveSampling {
 public:
  // `film` of weighted samples, without any.
  AdaptiveSampling(Device& device, Wave& wave, Film& film, const RenderSettings& settings);
  // Puts the coming pass's blocks where camera_sampled and accumulate_sampled look. Returns how many there are.
  std::uint32_t begin_pass(Commands& commands);
  // Flushes `commands` where a window of passes has ended. False: the picture is as quiet as was asked for.
  bool end_pass(Commands& commands);

 private:
  Wave& wave_;
  Film& film_;
  AdaptivePlan plan_;
  Buffer blocks_;  // SampledBlock[]
  float exposure_;
};

}  // namespace hw

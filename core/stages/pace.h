// SPDX-License-Identifier: Apache-2.0
// How much of a render a submission may hold, where nothing but the device is needed to go on: as much as it can run in
// a fraction of the time in which a cancelled render must end. Small frames are one submission; long ones are cut
// between the steps of a wave.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/device.h"

namespace hw {

class Pace {
 public:
  void begin();  // a render, with nothing recorded
  // Step `step` (its bounce) of a wave of `paths` was recorded.
  void recorded(std::uint32_t step, std::uint32_t paths);
  // Whether what is recorded should run before more is.
  bool due() const { return due_; }
  // Submits what is recorded, waits for it, and learns what steps cost.
  void submit(Commands& commands);
  // Whether the last submission is so long ago that somebody may be waiting for the picture.
  bool late() const;

 private:
  struct Step {
    std::uint32_t step, paths;
  };
  double cost(std::uint32_t step) const;  // seconds a path; a guess for steps never run, 0 before any ran

  std::vector<double>
      costs_;  // seconds a path of a wave, by step; what later steps add for paths that have ended is little
  std::vector<Step> pending_;
  double predicted_ = 0;  // seconds of pending_
  bool due_ = false;
  std::int64_t submitted_ = 0;  // steady clock, nanoseconds
};

}  // namespace hw

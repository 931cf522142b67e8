// SPDX-License-Identifier: Apache-2.0
// A reservoir and its surface for every pixel, twice: of the last pass, which is read, and of the pass under way, which
// is written. Two buffers rather than one, so that no pixel reads what another is writing (SivaramWSSR, section 5).
#pragma once

#include <cstdint>
#include <memory>

#include "gpu/device.h"
#include "shared/reuse.h"

namespace hw {

class ScreenReservoirs {
 public:
  ScreenReservoirs(Device& device, std::uint32_t width, std::uint32_t height);
  bool fits(std::uint32_t width, std::uint32_t height) const { return width == width_ && height == height_; }
  std::uint64_t bytes() const;
  std::uint32_t pixels() const { return width_ * height_; }
  void fill(ReuseFrame& frame) const;
  // Before a pass: every pixel that will be written starts without a surface.
  void begin_pass(Commands& commands);
  // After a pass: what was written is what the next one reads.
  void end_pass() { current_ ^= 1; }

  bool has_history = false;  // a pass has been written

 private:
  std::uint32_t width_, height_;
  std::unique_ptr<Buffer> reservoirs_[2], surfaces_[2];
  int current_ = 0;
};

}  // namespace hw

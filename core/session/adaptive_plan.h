// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling: which blocks of pixels each pass samples, so that samples go where noise is left.
//
// Passes come in windows of a power of two. In each window a block takes all of its passes or a half or a quarter of
// them, every second or fourth, and its samples weigh 1, 2 or 4 to make up for it: at a window's end the weights of
// every pixel are the number of passes. How many a block takes is decided before the window, by what its pixels showed
// until then: given that, a window's sum has the expectation of all its passes, so that the picture is unbiased
// whatever was decided. (Fewer samples and the mean of those there are would favour pixels whose bright samples are
// still to come.)
//
// No device in here.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/path.h"

namespace hw {

class AdaptivePlan {
 public:
  // For a region of so many pixels and so many passes, at least 1. Once the relative error of all blocks is at most
  // `threshold` (0: never), after `min_samples`, it is quiet().
  AdaptivePlan(std::uint32_t width, std::uint32_t height, std::uint32_t samples, float threshold,
               std::uint32_t min_samples);

  std::uint32_t blocks() const { return std::uint32_t(state_.size()); }
  // The blocks of the coming pass, in order.
  const std::vector<SampledBlock>& next_pass();
  // Whether it would help to know how noisy blocks are before the next pass.
  bool wants_noise() const { return window_left_ == 0 && done_ >= kFirstWindow && done_ < samples_; }
  // Of each block, by film_noise().
  void set_noise(std::span<const float> differences);
  bool quiet() const { return quiet_; }

 private:
  static constexpr std::uint32_t kFirstWindow = 2;  // what a difference takes
  struct Block {
    std::uint32_t odd = 0;     // the half that the next sample belongs to
    std::uint32_t period = 1;  // takes every so many passes of the window
    // Of each half: weights and their squares.
    float weight[2] = {0, 0}, weight2[2] = {0, 0};
  };
  void begin_window();
  std::vector<float> smoothed(const std::vector<float>& noise) const;
  void choose_periods(const std::vector<float>& noise);

  std::uint32_t across_, down_, samples_, min_samples_;
  float threshold_;
  std::vector<Block> state_;
  std::vector<SampledBlock> pass_;
  std::uint32_t done_ = 0;  // passes
  std::uint32_t window_ = 0, window_left_ = 0;
  bool quiet_ = false;
};

}  // namespace hw

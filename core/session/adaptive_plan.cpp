// SPDX-License-Identifier: Apache-2.0
// Windows, and the choice of who takes how many of their passes.
#include "session/adaptive_plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "lib/sampler.h"

namespace hw {

namespace {

// Rarer samples weigh more: beyond this what they gain is little, and a rare bright one shows.
constexpr std::uint32_t kLongestPeriod = 4;
// What a picture may have more of its squared error than one of all passes: it should look like so many samples.
constexpr double kMoreError = 1.1;
constexpr int kSteps = 48;  // of the square root of a half each, from the noisiest block down

// The period for so much noise where blocks of the noise `full` take every pass: its square root is what samples should
// be in proportion to.
std::uint32_t period_for(float noise, float full) {
  const double rate = noise > 0 ? std::sqrt(double(noise) / full) : 0;
  if (rate >= std::sqrt(0.5)) return 1;
  return rate >= std::sqrt(0.125) ? 2 : kLongestPeriod;
}

}  // namespace

AdaptivePlan::AdaptivePlan(std::uint32_t width, std::uint32_t height, std::uint32_t samples, float threshold,
                           std::uint32_t min_samples)
    : across_(blocks_along(width)),
      down_(blocks_along(height)),
      samples_(samples),
      min_samples_(min_samples),
      threshold_(threshold),
      state_(std::size_t(across_) * down_) {}

// As long as all before it, so that what is known stays about as good as what is done with it.
void AdaptivePlan::begin_window() {
  const std::uint32_t left = samples_ - done_;
  window_ = std::bit_floor(std::min(std::max(done_, kFirstWindow), left));
  window_left_ = window_;
}

const std::vector<SampledBlock>& AdaptivePlan::next_pass() {
  if (window_left_ == 0) begin_window();
  const std::uint32_t pass = window_ - window_left_;
  pass_.clear();
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    Block& b = state_[i];
    const std::uint32_t period = std::min(b.period, window_);
    if (pass % period != sampler_hash(i) % period) continue;
    const std::uint32_t log2 = std::uint32_t(std::countr_zero(period));
    // Counted from the window's first pass: an aligned run of the sequence, which is well spread by itself.
    const std::uint32_t number = done_ - pass + pass / period;
    pass_.push_back({i, number | b.odd * HW_SAMPLE_ODD | log2 << HW_SAMPLE_WEIGHT_SHIFT});
    b.weight[b.odd] += float(period);
    b.weight2[b.odd] += float(period * period);
    b.odd ^= 1;
  }
  --window_left_;
  ++done_;
  return pass_;
}

void AdaptivePlan::set_noise(std::span<const float> differences) {
  // Of one sample: the difference of two means of n is of 2 / n of its variance.
  std::vector<float> noise(state_.size());
  for (std::size_t i = 0; i < state_.size(); ++i) {
    const Block& b = state_[i];
    const float shares = b.weight2[0] / (b.weight[0] * b.weight[0]) + b.weight2[1] / (b.weight[1] * b.weight[1]);
    noise[i] = std::isfinite(shares) ? differences[i] / shares : 0;
  }
  noise = smoothed(noise);
  choose_periods(noise);
  if (!(threshold_ > 0) || done_ < min_samples_) return;
  quiet_ = true;
  for (std::size_t i = 0; i < state_.size(); ++i) {
    Block& b = state_[i];
    const float all = b.weight[0] + b.weight[1];
    const bool below = noise[i] * (b.weight2[0] + b.weight2[1]) <= threshold_ * threshold_ * all * all;
    quiet_ = quiet_ && below;
    if (below) b.period = kLongestPeriod;
  }
}

// Half from the blocks around: one that has seen no rare bright sample yet has neighbours that may have.
std::vector<float> AdaptivePlan::smoothed(const std::vector<float>& noise) const {
  std::vector<float> out(noise.size());
  for (std::uint32_t y = 0; y < down_; ++y)
    for (std::uint32_t x = 0; x < across_; ++x) {
      float sum = 0;
      int count = 0;
      for (std::uint32_t v = y ? y - 1 : 0; v <= std::min(y + 1, down_ - 1); ++v)
        for (std::uint32_t u = x ? x - 1 : 0; u <= std::min(x + 1, across_ - 1); ++u) {
          sum += noise[std::size_t(v) * across_ + u];
          ++count;
        }
      const std::size_t i = std::size_t(y) * across_ + x;
      out[i] = 0.5f * noise[i] + 0.5f * sum / float(count);
    }
  return out;
}

// The most noise from which on blocks take every pass, that leaves the picture about as good as all passes would.
void AdaptivePlan::choose_periods(const std::vector<float>& noise) {
  const float most = *std::max_element(noise.begin(), noise.end());
  double all = 0;
  for (float n : noise) all += n;
  const auto error = [&noise](float full) {
    double sum = 0;
    for (float n : noise) sum += double(n) * period_for(n, full);
    return sum;
  };
  float full = most;
  for (int step = 0; step < kSteps && error(full) > kMoreError * all; ++step) full *= 0.7071068f;
  for (std::size_t i = 0; i < state_.size(); ++i) state_[i].period = most > 0 ? period_for(noise[i], full) : 1;
}

}  // namespace hw

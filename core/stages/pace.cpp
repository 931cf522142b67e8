// SPDX-License-Identifier: Apache-2.0
// Cuts recordings by what their steps took before.
#include "stages/pace.h"

#include <algorithm>
#include <chrono>

namespace hw {

namespace {

// Seconds of a submission. A cancelled render waits for one, and must end within half a second.
constexpr double kBudget = 0.1;
// A step never run is taken to be this much dearer than the one before it: later rays are fewer, but scattered.
constexpr double kGuess = 1.5;

std::int64_t now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

double Pace::cost(std::uint32_t step) const {
  if (step < costs_.size()) return costs_[step];
  return costs_.empty() ? 0 : kGuess * costs_.back();
}

void Pace::begin() {
  pending_.clear();
  predicted_ = 0;
  due_ = false;
  submitted_ = now();
}

void Pace::recorded(std::uint32_t step, std::uint32_t paths) {
  pending_.push_back({step, paths});
  predicted_ += cost(step) * paths;
  // What comes next may be the first step of another wave.
  due_ = costs_.empty() || predicted_ + std::max(cost(step + 1), costs_.front()) * paths > kBudget;
}

void Pace::submit(Commands& commands) {
  const std::int64_t before = now();
  commands.flush();
  submitted_ = now();
  const double seconds = 1e-9 * static_cast<double>(submitted_ - before);
  double predicted = 0;
  for (const Step& s : pending_) predicted += cost(s.step) * s.paths;
  std::uint64_t paths = 0;
  for (const Step& s : pending_) paths += s.paths;
  // What was measured is shared out as it was foreseen. One slow submission, another process's fault, is half believed.
  const double ratio = predicted > 0 ? std::clamp(seconds / predicted, 0.1, 10.0) : 0;
  for (const Step& s : pending_) {
    const double foreseen = cost(s.step), measured = predicted > 0 ? foreseen * ratio : seconds / double(paths);
    if (s.step < costs_.size())
      costs_[s.step] = 0.5 * (foreseen + measured);
    else
      while (costs_.size() <= s.step) costs_.push_back(measured);
  }
  pending_.clear();
  predicted_ = 0;
  due_ = false;
}

bool Pace::late() const { return 1e-9 * static_cast<double>(now() - submitted_) > kBudget; }

}  // namespace hw

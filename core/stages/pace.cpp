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
  const std::int64_t started = now();
  commands.flush();
  submitted_ = now();
  const double seconds = 1e-9 * static_cast<double>(submitted_ - started);
  std::vector<double> foreseen;
  double predicted = 0, paths = 0;
  for (const Step& s : pending_) {
    foreseen.push_back(cost(s.step));
    predicted += foreseen.back() * s.paths;
    paths += s.paths;
  }
  // What was measured is shared out as it was foreseen. A slow submission may be another process's fault, or a driver's
  // that compiled first: it is half believed.
  const double ratio = predicted > 0 ? seconds / predicted : 0;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    const double before = foreseen[i], measured = predicted > 0 ? before * ratio : seconds / paths;
    const std::uint32_t step = pending_[i].step;
    if (step < costs_.size() && measured >= before)
      costs_[step] = 0.5 * (before + std::min(measured, 10 * before));
    else if (step < costs_.size())
      costs_[step] = measured;
    else
      costs_.resize(step + 1, measured);
  }
  pending_.clear();
  predicted_ = 0;
  due_ = false;
}

bool Pace::late() const { return 1e-9 * static_cast<double>(now() - submitted_) > kBudget; }

}  // namespace hw

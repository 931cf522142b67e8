// SPDX-License-Identifier: Apache-2.0
// `wssr-hash`: light samples proposed by distributions that cells in world space learn from the shadow rays of every
// bounce (shared/light_cells.h). What is kept from sample to sample is knowledge, never a sample: every sample is
// unbiased and independent given what was known, so that the error keeps falling.
#pragma once

#include <memory>
#include <optional>

#include "integrators/path_splitting.h"
#include "integrators/path_stages.h"

namespace hw {

class WssrHashIntegrator final : public Integrator {
 public:
  explicit WssrHashIntegrator(const IntegratorContext& context);
  bool render(Commands& commands) override;
  int preparations() const override { return preparations_; }
  std::uint32_t preparation_pixels() const override;
  int preparation_set(int preparation) const override;
  bool prepare(Commands& commands, int preparation) override;
  bool samples_are_independent() const override { return false; }
  void begin_frame(Commands& commands) override;
  std::uint32_t seed(std::uint32_t given) const override;
  void end_pass(Commands& commands, int preparation) override;

 private:
  void begin_splitting(bool keeps);
  bool paths(Commands& commands, bool by_tree, bool preparing);
  PathStages& stages(LightSource source);
  void end_round(Commands& commands, int preparation);
  void end_round_by_tree(Commands& commands, int round);
  bool learns_now();
  LightCells& cells() const { return *context_.reservoirs.light_cells; }

  IntegratorContext context_;
  ReuseParams params_;
  std::unique_ptr<Buffer> wanted_, visited_;  // for each path
  int preparations_ = 0;
  std::uint32_t frame_passes_ = 0;
  std::optional<PathSplitting> splitting_;  // where the number of bounces is to be found out, and whether cells pay
  Queue missing_;                           // paths whose cell is not there
  const Kernel& request_;
  const Kernel& update_;
  const Kernel& insert_;
  const Kernel& clear_;
  const Kernel& refit_;
  std::optional<PathStages> stages_[2][2];  // by the cells or by the tree; alone or with path reuse
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// `wssr-kd`, `wssr-grid` and `wssr-grid-reproject` with `estimator` unbiased: records in world space, merged by MIS
// weights with a canonical sample at the surfaces of every bounce.
#pragma once

#include "integrators/path_stages.h"
#include "integrators/wssr.h"
#include "stages/reuse_wave.h"

namespace hw {

class WssrUnbiasedIntegrator final : public Integrator {
 public:
  WssrUnbiasedIntegrator(const IntegratorContext& context, CellStructure structure);
  bool render(Commands& commands) override;
  bool samples_are_independent() const override { return false; }
  void begin_frame(Commands& commands) override;
  int preparations() const override { return preparations_; }
  bool prepare(Commands& commands, int preparation) override;
  void end_pass(Commands& commands, int preparation) override;

 private:
  enum class Kept { kAll, kStructure, kNothing };  // of the last frame
  bool tree() const { return structure_ == CellStructure::kTree; }
  bool builds_tree(int preparation) const { return wants_tree_ && preparation == 0; }
  void start_cells(Commands& commands, Kept kept);
  // What the tree's leaves saw up to the last pass.
  std::vector<LeafSurvey> survey(Commands& commands);
  FollowingTreeHost::Rules rules() const;
  // Canonical samples of a class's surfaces, and the race for their cells' records.
  void sample(Commands& commands, std::size_t shading_class);
  // The race's winners are written down, as the paths' reservoirs are now.
  void keep(Commands& commands, std::size_t shading_class);

  IntegratorContext context_;
  ReuseParams params_;
  CellStructure structure_;
  PathStages stages_;
  ReuseWave buffers_;
  const Kernel& candidates_;
  const Kernel& offer_;
  const Kernel& winner_;
  const Kernel& merge_;
  const Kernel& begin_;
  const Kernel& update_;
  int preparations_ = 0;
  std::uint32_t passes_ = 0;  // of this frame
  bool wants_tree_ = false;   // the first preparation gathers its points
  std::vector<vec3> points_;  // first surfaces, for the tree
};

}  // namespace hw

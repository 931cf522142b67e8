// SPDX-License-Identifier: Apache-2.0
// `wssr-kd`, `wssr-grid` and `wssr-grid-reproject`: reservoirs in world space (SivaramWSSR, section 4), read and fed by
// the surfaces of every bounce.
#pragma once

#include "integrators/path_stages.h"
#include "stages/reuse_wave.h"

namespace hw {

enum class CellStructure { kTree, kGrid, kGridReproject };

// The kernel of a stage over cells, which has a variant for the tree.
const Kernel& cell_kernel(const IntegratorContext& context, const std::string& stage, CellStructure structure,
                          const SpecConstants& constants);

// What decides how many cells there are and what they stand for.
std::string cell_layout(const RenderSettings& settings, const ReuseParams& params);

class WssrIntegrator final : public Integrator {
 public:
  WssrIntegrator(const IntegratorContext& context, CellStructure structure);
  bool render(Commands& commands) override;
  bool samples_are_independent() const override { return false; }
  void begin_frame(Commands& commands) override;
  int preparations() const override { return preparations_; }
  bool prepare(Commands& commands, int preparation) override;
  void end_pass(Commands& commands, int preparation) override;

 private:
  bool builds_tree(int preparation) const { return wants_tree_ && preparation == 0; }
  void start_cells(Commands& commands, bool empty);
  // Canonical samples of a class's surfaces, offered to their cells.
  void sample(Commands& commands, std::size_t shading_class);

  IntegratorContext context_;
  ReuseParams params_;
  CellStructure structure_;
  PathStages stages_;
  ReuseWave buffers_;
  const Kernel& candidates_;
  const Kernel& insert_;
  const Kernel& winner_;
  const Kernel& reuse_;
  const Kernel& begin_;
  const Kernel& update_;
  int preparations_ = 0;
  bool wants_tree_ = false;   // the first preparation gathers its points
  std::vector<vec3> points_;  // first surfaces, for the tree
};

}  // namespace hw

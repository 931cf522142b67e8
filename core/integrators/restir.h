// SPDX-License-Identifier: Apache-2.0
// `restir` and `restir-reproject`: reservoir resampling in screen space (Bitterli et al. 2020; SivaramWSSR, sections 3
// and 3.1).
#pragma once

#include "integrators/path_stages.h"
#include "stages/reuse_wave.h"

namespace hw {

class RestirIntegrator final : public Integrator {
 public:
  RestirIntegrator(const IntegratorContext& context, bool reproject);
  bool render(Commands& commands) override;
  bool samples_are_independent() const override { return false; }
  void begin_frame(Commands& commands) override;
  int preparations() const override;
  bool prepare(Commands& commands, int preparation) override;
  void begin_pass(Commands& commands) override;
  void end_pass(Commands& commands, int preparation) override;

 private:
  // Canonical samples of a class's surfaces, tested for visibility where that is asked for, then merged.
  void resample(Commands& commands, std::size_t shading_class);

  IntegratorContext context_;
  ReuseParams params_;
  bool reproject_;
  PathStages stages_;
  ReuseWave buffers_;
  const Kernel& candidates_;
  const Kernel& reuse_;
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Unidirectional path tracing: next-event estimation weighed against BSDF sampling, Russian roulette.
// Follows Veach 1997 (chapters 8-10) in the wavefront form of Laine, Karras and Aila 2013.
#pragma once

#include "integrators/path_stages.h"

namespace hw {

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const IntegratorContext& context);
  bool render(Commands& commands) override;

 private:
  PathStages stages_;
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Path tracing as a list of stages:
//   camera → trace → [ sort hits → escaped, surface → shade → light program → trace shadow (→ shadow surface)* →
//   resolve → trace ]*
// `escaped` takes what lies behind everything and lamps; `surface` turns hits into closures and takes emission; `shade`
// samples a light and the BSDF; `resolve` adds the light samples that arrived. `surface` and `shade` run once for each
// class of objects (scene/shading_classes.h); `light program` only where a light's emission is a program. Paths stay in
// place, queues of path ids shrink as paths end.
#include "integrators/path.h"

namespace hw {

PathIntegrator::PathIntegrator(const IntegratorContext& context)
    : cancelled_(context.cancelled), stages_(context, false) {}

bool PathIntegrator::render(Commands& commands) {
  stages_.camera(commands);
  for (int step = 0;; ++step) {
    if (cancelled_) return false;
    stages_.sort_hits(commands);
    for (std::size_t c = 0; c < stages_.classes(); ++c) {
      stages_.surface(commands, c);
      stages_.shade(commands, c);
    }
    if (!stages_.light(commands)) return false;
    if (!stages_.advance(commands, step)) return true;
  }
}

}  // namespace hw

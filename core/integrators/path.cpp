// SPDX-License-Identifier: Apache-2.0
// Path tracing as a list of stages:
//   camera → trace → [ sort hits → escaped, surface → shade → trace → light program → trace shadow (→ shadow surface)*
//   → resolve ]*
// `escaped` takes what lies behind everything and lamps; `surface` turns hits into closures and takes emission; `shade`
// samples lights and the BSDF; `resolve` adds the light samples that arrived. `surface` and `shade` run once for each
// class of objects (scene/shading_classes.h); `light program` only where a light's emission is a program. Paths stay in
// place, queues of path ids shrink as paths end.
#include "integrators/path.h"

namespace hw {

PathIntegrator::PathIntegrator(const IntegratorContext& context)
    : stages_(with_path_reuse(context, context.wave.path_reuse()), LightSource::kDrawn) {}

bool PathIntegrator::render(Commands& commands) {
  return stages_.render(commands, [](std::size_t) {});
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Registry of integrators by name.
#include "integrators/integrator.h"

#include "integrators/path.h"
#include "session/session.h"

namespace hw {

std::vector<std::string> integrator_names() {
  std::vector<std::string> names;
  for (const IntegratorInfo& info : integrator_table()) names.push_back(info.name);
  return names;
}

std::unique_ptr<Integrator> make_integrator(const IntegratorContext& context) {
  return std::make_unique<PathIntegrator>(context);
}

}  // namespace hw

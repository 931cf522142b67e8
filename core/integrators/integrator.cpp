// SPDX-License-Identifier: Apache-2.0
// Registry of integrators by name.
#include "integrators/integrator.h"

#include <stdexcept>

#include "integrators/path.h"
#include "session/session.h"

namespace hw {

std::vector<std::string> integrator_names() { return {"path"}; }

std::unique_ptr<Integrator> make_integrator(const std::string& name, const IntegratorContext& context) {
  if (name == "path") return std::make_unique<PathIntegrator>(context);
  std::string known;
  for (const std::string& n : integrator_names()) known += (known.empty() ? "" : ", ") + n;
  throw std::invalid_argument("there is no integrator named '" + name + "'; the integrators are " + known);
}

}  // namespace hw

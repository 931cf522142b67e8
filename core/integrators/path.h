// SPDX-License-Identifier: Apache-2.0
// Unidirectional path tracing: next-event estimation weighed against BSDF sampling, Russian roulette.
// Follows Veach 1997 (chapters 8-10) in the wavefront form of Laine, Karras and Aila 2013.
#pragma once

#include "integrators/integrator.h"

namespace hw {

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const IntegratorContext& context);
  bool render(Commands& commands) override;

 private:
  void prepare(Commands& commands, Queue* queue, std::uint32_t counter, Queue* clear, Queue* clear2 = nullptr);
  bool trace_transparent_shadows(Commands& commands);
  std::uint32_t count(Commands& commands, Queue& queue);

  IntegratorContext context_;
  const Kernel& camera_;
  const Kernel& sort_;
  const Kernel& escaped_;
  const Kernel& resolve_;
  const Kernel& prepare_;
  std::vector<const Kernel*> surface_, shade_;  // by class
  const Kernel* light_program_ = nullptr;       // only where lights' emission is a program
  const Kernel* shadow_begin_ = nullptr;        // these two only in scenes that let shadow rays through
  const Kernel* shadow_surface_ = nullptr;
};

}  // namespace hw

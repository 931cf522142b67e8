// SPDX-License-Identifier: Apache-2.0
// Registry of integrators by name.
#include "integrators/integrator.h"

#include <algorithm>

#include "integrators/path.h"
#include "integrators/path_splitting.h"
#include "integrators/restir.h"
#include "integrators/wssr.h"
#include "integrators/wssr_hash.h"
#include "integrators/wssr_unbiased.h"
#include "session/session.h"

namespace hw {

namespace {

// With fewer lights than this the tree finds them as well as any reuse, at a fraction of the cost.
constexpr std::uint32_t kFewLights = 8;

}  // namespace

std::vector<std::string> integrator_names() {
  std::vector<std::string> names;
  for (const IntegratorInfo& info : integrator_table()) names.push_back(info.name);
  return names;
}

bool renders_by_path(const RenderSettings& settings, std::uint32_t light_count) {
  return settings.integrator == "path" || light_count < kFewLights;
}

bool samples_adaptively(const RenderSettings& settings) {
  const bool any_pixels = settings.integrator == "path" || settings.integrator == "wssr-hash";
  return settings.adaptive_sampling && any_pixels && !settings.resume;
}

bool reuses_paths(const RenderSettings& settings, std::uint32_t light_count) {
  if (settings.max_bounces == 0 || !resolve_reuse(settings).path_reuse) return false;
  if (settings.reuse.path_reuse) return true;
  return !renders_by_path(settings, light_count) && !resolve_reuse(settings).bounce_samples;
}

std::uint32_t most_bounce_samples(const RenderSettings& settings) {
  const std::uint32_t asked = resolve_reuse(settings).bounce_samples;
  return asked ? asked : settings.integrator == "wssr-hash" ? kMostBounceSamples : 1;
}

std::uint32_t light_samples(const RenderSettings& settings, std::uint32_t light_count) {
  const std::uint32_t wanted = resolve_reuse(settings).light_samples;
  return settings.reuse.light_samples ? wanted : std::min(wanted, std::max(light_count, 1u));
}

std::unique_ptr<Integrator> make_integrator(const IntegratorContext& context) {
  const std::string& name = context.settings.integrator;
  if (renders_by_path(context.settings, context.light_count)) {
    if (!context.settings.continue_history) context.reservoirs.clear();  // else it comes between two frames of another
    return std::make_unique<PathIntegrator>(context);
  }
  const bool unbiased = resolve_reuse(context.settings).unbiased;
  if (name.starts_with("wssr") && !unbiased && !context.device.info().int64_atomics)
    throw DeviceError("the integrator '" + name + "' needs atomics on 64-bit numbers, which the driver of " +
                      context.device.info().name + " lacks; the estimator 'unbiased', 'restir' and 'path' do without");
  if (name == "wssr-hash") return std::make_unique<WssrHashIntegrator>(context);
  if (name.starts_with("wssr")) {
    const CellStructure structure = name == "wssr-kd"     ? CellStructure::kTree
                                    : name == "wssr-grid" ? CellStructure::kGrid
                                                          : CellStructure::kGridReproject;
    if (unbiased) return std::make_unique<WssrUnbiasedIntegrator>(context, structure);
    return std::make_unique<WssrIntegrator>(context, structure);
  }
  return std::make_unique<RestirIntegrator>(context, name == "restir-reproject");
}

}  // namespace hw

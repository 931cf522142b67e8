// SPDX-License-Identifier: Apache-2.0
// The stages of `wssr-hash`, in the place of path's light sample:
//   surface → choose (→ request) → shade → trace shadow → learn …   and after a pass: update, insert
// Cells change between passes only, so that a pass gives the same picture in any order of waves and threads.
#include "integrators/wssr_hash.h"

#include <algorithm>
#include <string>

#include "stages/reuse_wave.h"

namespace hw {

namespace {

constexpr float kCellPixels = 16;  // width of a cell in the picture
constexpr float kFloor = 0.02f;    // of what a node is thought to give, over what nodes give in the mean
constexpr std::uint32_t kKeepPasses = 64;
constexpr float kLeastSize = 1e-4f;  // of the scene's radius

}  // namespace

WssrHashIntegrator::WssrHashIntegrator(const IntegratorContext& context)
    : context_(context),
      params_(resolve_reuse(context.settings)),
      missing_(context.device, context.wave.capacity(), "missing light cells"),
      leaves_kernel_(context.kernels.get("light_leaves", context.constants)),
      choose_(context.kernels.get("light_cell_choose", context.constants)),
      request_(context.kernels.get("light_cell_request", context.constants)),
      learn_(context.kernels.get("light_cell_learn", context.constants)),
      update_(context.kernels.get("light_cell_update", context.constants)),
      insert_(context.kernels.get("light_cell_insert", context.constants)),
      clear_(context.kernels.get("light_cell_clear", context.constants)) {
  const auto make = [&](std::uint64_t element, std::uint64_t count, const char* label) {
    return std::make_unique<Buffer>(context.device, element * count, BufferUse::device, label);
  };
  chosen_ = make(sizeof(LightChoice) * params_.light_samples, context.wave.capacity(), "light choices");
  targets_ = make(sizeof(ReuseSurface), context.wave.capacity(), "path targets");
  leaves_ = make(sizeof(LightLeaf), std::max(context.light_count, 1u), "light leaves");
  context_.wave.params().light_samples = params_.light_samples;
  stages_ = std::make_unique<PathStages>(context_, LightSource::kChosen);
}

void WssrHashIntegrator::begin_frame(Commands& commands) {
  ReservoirStore& store = context_.reservoirs;
  const RenderSettings& s = context_.settings;
  const std::string kind = s.integrator + " " + std::to_string(params_.reservoir_memory);
  const bool keeps = (s.continue_history || s.resume) && store.kind == kind && store.light_cells &&
                     store.light_cells->tree == context_.light_tree_revision;
  if (store.kind != kind || !store.light_cells) {
    store.clear();
    store.kind = kind;
    store.light_cells =
        std::make_unique<LightCells>(context_.device, std::uint64_t(params_.reservoir_memory) * 1024 * 1024);
  }
  store.light_cells->tree = context_.light_tree_revision;
  if (!keeps) store.light_cells->passes = 0;

  FrameParams& frame = context_.wave.params();
  frame.reuse.targets = targets_->address();
  frame.reuse.light_mis_scale = static_cast<float>(params_.candidates);
  LightCellFrame& f = frame.light_cells;
  cells().fill(f);
  f.missing = missing_.address();
  f.chosen = chosen_->address();
  f.leaves = leaves_->address();
  f.candidates = params_.candidates;
  f.pass = cells().passes;
  f.size = kCellPixels * context_.pixel_size;
  f.least_size = kLeastSize * context_.scene_radius;
  f.floor = kFloor;
  f.keep = kKeepPasses;
  f.fixed_exponent = light_sum_exponent(context_.light_power);
  context_.wave.write_params(commands);

  commands.begin_stage("light cells");
  dispatch_all(commands, context_.device, leaves_kernel_, context_.light_count);
  dispatch_all(commands, context_.device, clear_, cells().buckets(), keeps ? 0 : 1);
  stages_->prepare(commands, nullptr, RayKind::kNone, &missing_);
  commands.flush();
}

void WssrHashIntegrator::choose(Commands& commands, std::size_t c) {
  commands.begin_stage("choose lights");
  stages_->dispatch(commands, choose_, stages_->surfaces(c));
  stages_->prepare(commands, &missing_, RayKind::kNone, nullptr);
  stages_->dispatch(commands, request_, missing_);
  stages_->prepare(commands, nullptr, RayKind::kNone, &missing_);
}

bool WssrHashIntegrator::render(Commands& commands) {
  stages_->on_shadows = [&](Queue& shadow_rays, std::uint32_t number) {
    commands.begin_stage("learn lights");
    stages_->dispatch(commands, learn_, shadow_rays, {.a = number});
  };
  return stages_->render(commands, [&](std::size_t c) { choose(commands, c); });
}

void WssrHashIntegrator::end_pass(Commands& commands, int) {
  commands.begin_stage("light cells");
  dispatch_all(commands, context_.device, update_, cells().count());
  dispatch_all(commands, context_.device, insert_, cells().buckets());
  commands.flush();
  context_.wave.params().light_cells.pass = ++cells().passes;
}

}  // namespace hw

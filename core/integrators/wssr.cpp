// SPDX-License-Identifier: Apache-2.0
// World-space reuse as a list of stages, in the place of path's light sample:
//   surface → light candidates → cell insert → cell winner → cell reuse → shade …   and after a pass: cell update
// One sample of every pixel is a pass; its surfaces read the cells as the last pass left them, and offer their
// canonical samples for the next. A render without history is preceded by passes that leave no light: for the tree one
// that gathers the first surfaces it is built over (camera → trace), then one that fills the cells.
#include "integrators/wssr.h"

#include "lib/world_grid.h"

namespace hw {

namespace {

bool tree(CellStructure s) { return s == CellStructure::kTree; }

}  // namespace

const Kernel& cell_kernel(const IntegratorContext& context, const std::string& stage, CellStructure structure,
                          const SpecConstants& constants) {
  return context.kernels.get(tree(structure) ? stage + "_tree" : stage, constants);
}

std::string cell_layout(const RenderSettings& settings, const ReuseParams& p) {
  return settings.integrator + " " + std::to_string(p.reservoirs_per_cell) + " " + std::to_string(p.points_per_leaf) +
         " " + std::to_string(p.grid_resolution) + " " + std::to_string(p.grid_extent) + (p.grid_rides ? " rides" : "");
}

WssrIntegrator::WssrIntegrator(const IntegratorContext& context, CellStructure structure)
    : context_(context),
      params_(resolve_reuse(context.settings)),
      structure_(structure),
      stages_(context, LightSource::kReservoir),
      buffers_(context.device, context.wave.capacity(), context.light_count, true),
      candidates_(context.kernels.get("light_candidates", context.constants)),
      insert_(cell_kernel(context, "cell_insert", structure, context.constants)),
      winner_(context.kernels.get("cell_winner", context.constants)),
      reuse_(cell_kernel(context, "cell_reuse", structure, context.constants)),
      begin_(cell_kernel(context, "cell_begin", structure, context.constants)),
      update_(context.kernels.get("cell_update", context.constants)) {}

void WssrIntegrator::begin_frame(Commands& commands) {
  ReservoirStore& store = context_.reservoirs;
  ReuseFrame& frame = context_.wave.params().reuse;
  apply_reuse(frame, params_, context_.settings.width, context_.settings.height);
  buffers_.fill(frame);
  buffers_.follow_lights(context_.device, frame, context_.light_changes);
  if (structure_ == CellStructure::kGridReproject) frame.flags |= HW_REUSE_REPROJECT;
  frame.fixed_exponent = light_sum_exponent(context_.light_power);
  frame.grid = world_grid(context_.camera_position, params_.grid_extent, params_.grid_resolution,
                          params_.reservoirs_per_cell, params_.grid_rides);
  const std::string kind = cell_layout(context_.settings, params_);
  // The tree is static: it outlives its samples.
  const bool keeps_cells = context_.settings.continue_history && store.kind == kind && store.cells;
  const bool keeps = keeps_cells && keeps_history(context_, kind) && store.cells->has_history;
  if (!keeps_cells) {
    store.clear();
    store.kind = kind;
  }
  if (!keeps) store.passes = context_.settings.first_sample;
  frame.pass = store.passes;
  context_.wave.write_params(commands);
  make_light_proxies(commands, context_);
  wants_tree_ = !keeps_cells && tree(structure_);
  preparations_ = (wants_tree_ ? 1 : 0) + (keeps ? 0 : 1);
  if (wants_tree_) {
    points_.clear();
    points_.reserve(std::size_t(context_.width) * context_.height);
    return;
  }
  if (!keeps_cells)
    store.cells = CellReservoirs::of_grid(context_.device, params_.grid_resolution, params_.reservoirs_per_cell);
  start_cells(commands, !keeps);
}

void WssrIntegrator::start_cells(Commands& commands, bool empty) {
  context_.reservoirs.cells->fill(context_.wave.params().reuse);
  context_.wave.write_params(commands);
  commands.begin_stage("cells");
  dispatch_all(commands, context_.device, begin_, context_.reservoirs.cells->count(), empty ? 1 : 0);
  stages_.prepare(commands, nullptr, RayKind::kNone, &context_.reservoirs.cells->touched());
}

bool WssrIntegrator::prepare(Commands& commands, int preparation) {
  if (!builds_tree(preparation)) return stages_.first_surfaces(commands, [&](std::size_t c) { sample(commands, c); });
  if (context_.cancelled) return false;
  stages_.camera(commands);
  append_first_surfaces(commands, context_, points_);
  return true;
}

void WssrIntegrator::end_pass(Commands& commands, int preparation) {
  ReservoirStore& store = context_.reservoirs;
  if (builds_tree(preparation)) {
    store.cells = CellReservoirs::of_tree(context_.device, points_, params_.points_per_leaf,
                                          params_.reservoirs_per_cell, context_.threads);
    points_ = {};
    start_cells(commands, true);
    return;
  }
  commands.begin_stage("cells");
  Queue& touched = store.cells->touched();
  stages_.prepare(commands, &touched, RayKind::kNone, nullptr);
  stages_.dispatch(commands, update_, touched);
  stages_.prepare(commands, nullptr, RayKind::kNone, &touched);
  store.cells->has_history = true;
  context_.wave.params().reuse.pass = ++store.passes;
}

void WssrIntegrator::sample(Commands& commands, std::size_t c) {
  Queue& surfaces = stages_.surfaces(c);
  commands.begin_stage("candidates");
  stages_.dispatch(commands, candidates_, surfaces);
  commands.begin_stage("cells");
  stages_.dispatch(commands, insert_, surfaces);
  stages_.dispatch(commands, winner_, surfaces);
}

bool WssrIntegrator::render(Commands& commands) {
  return stages_.render(commands, [&](std::size_t c) {
    sample(commands, c);
    commands.begin_stage("reuse");
    stages_.dispatch(commands, reuse_, stages_.surfaces(c));
  });
}

}  // namespace hw

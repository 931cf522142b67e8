// SPDX-License-Identifier: Apache-2.0
// Unbiased world-space reuse as a list of stages, in the place of path's light sample:
//   surface → light candidates → record offer → record merge → record winner → shade …   after a pass: record update
// Without temporal reuse winners are written down before the merge, so that records are canonical samples and no pass
// knows of more than the one before it. A render without history is preceded by the passes of integrators/wssr.cpp.
#include "integrators/wssr_unbiased.h"

#include "lib/world_grid.h"

namespace hw {

namespace {

// A leaf is divided when as many times more surfaces fell in it as it was meant for, and goes when none did for as many
// passes: secondary rays come by now and then only.
constexpr std::uint32_t kCrowded = 4, kStalePasses = 16;
// Leaves that come, and leaves that go, at once.
constexpr std::uint32_t kMostChanges = 1 << 14;
// Passes of a frame after which the tree follows what bounces have seen; from then on, frames.
constexpr std::uint32_t kFirstPasses = 8;

}  // namespace

WssrUnbiasedIntegrator::WssrUnbiasedIntegrator(const IntegratorContext& context, CellStructure structure)
    : context_(context),
      params_(resolve_reuse(context.settings)),
      structure_(structure),
      stages_(context, LightSource::kReservoir),
      buffers_(context.device, context.wave.capacity(), context.light_count, true),
      candidates_(context.kernels.get("light_candidates", context.constants)),
      offer_(cell_kernel(context, "record_offer", structure, context.constants)),
      winner_(cell_kernel(context, "record_winner", structure, context.constants)),
      merge_(cell_kernel(context, "record_merge", structure, with_weights(context.constants, params_.weights))),
      begin_(cell_kernel(context, "record_begin", structure, context.constants)),
      update_(context.kernels.get("record_update", context.constants)) {}

FollowingTreeHost::Rules WssrUnbiasedIntegrator::rules() const {
  return {kCrowded * params_.points_per_leaf, context_.reservoirs.passes - 1, kStalePasses, kMostChanges};
}

void WssrUnbiasedIntegrator::begin_frame(Commands& commands) {
  ReservoirStore& store = context_.reservoirs;
  ReuseFrame& frame = context_.wave.params().reuse;
  apply_reuse(frame, params_, context_.settings.width, context_.settings.height);
  buffers_.fill(frame);
  buffers_.follow_lights(context_.device, frame, context_.light_changes);
  if (structure_ == CellStructure::kGridReproject) frame.flags |= HW_REUSE_REPROJECT;
  frame.grid = world_grid(context_.camera_position, params_.grid_extent, params_.grid_resolution,
                          params_.reservoirs_per_cell, false);
  const std::string kind = cell_layout(context_.settings, params_) + " unbiased";
  bool keeps_cells = context_.settings.continue_history && store.kind == kind && store.records;
  const bool keeps = keeps_cells && keeps_valid_history(context_, kind) && store.records->has_history;
  if (keeps_cells && tree() && store.records->has_history && !context_.settings.resume) {
    frame.pass = store.passes;
    store.records->fill(frame);
    context_.wave.write_params(commands);
    const std::vector<LeafSurvey> seen = survey(commands);
    keeps_cells = !FollowingTreeHost::outgrown(seen, rules());
    if (keeps_cells) store.records->follow(context_.device, seen, rules());
  }
  if (!keeps_cells) {
    store.clear();
    store.kind = kind;
    store.passes = context_.settings.first_sample;
  }
  frame.pass = store.passes;
  context_.wave.write_params(commands);
  make_light_proxies(commands, context_);
  wants_tree_ = !keeps_cells && tree();
  preparations_ = (wants_tree_ ? 1 : 0) + (keeps && keeps_cells ? 0 : 1);
  if (wants_tree_) {
    points_.reserve(std::size_t(context_.width) * context_.height);
    return;
  }
  if (!keeps_cells)
    store.records = RecordCells::of_grid(context_.device, params_.grid_resolution, params_.reservoirs_per_cell);
  start_cells(commands, !keeps_cells ? Kept::kNothing : keeps ? Kept::kAll : Kept::kStructure);
}

void WssrUnbiasedIntegrator::start_cells(Commands& commands, Kept kept) {
  RecordCells& cells = *context_.reservoirs.records;
  cells.fill(context_.wave.params().reuse);
  context_.wave.write_params(commands);
  commands.begin_stage("cells");
  dispatch_all(commands, context_.device, begin_, cells.count(), std::uint32_t(kept));
  stages_.prepare(commands, nullptr, RayKind::kNone, &cells.touched());
  commands.flush();
}

std::vector<LeafSurvey> WssrUnbiasedIntegrator::survey(Commands& commands) {
  const std::uint32_t leaves = context_.reservoirs.records->leaf_slots();
  Buffer seen(context_.device, leaves * sizeof(LeafSurvey), BufferUse::device, "leaf survey");
  commands.begin_stage("cells");
  dispatch_all(commands, context_.device, context_.kernels.get("record_survey", context_.constants), leaves, 0,
               seen.address());
  commands.flush();
  std::vector<LeafSurvey> out(leaves);
  context_.device.read(seen, 0, std::as_writable_bytes(std::span(out)));
  return out;
}

bool WssrUnbiasedIntegrator::prepare(Commands& commands, int preparation) {
  if (builds_tree(preparation)) {
    if (context_.cancelled) return false;
    stages_.camera(commands);
    append_first_surfaces(commands, context_, points_);
    return true;
  }
  return stages_.first_surfaces(commands, [&](std::size_t c) {
    sample(commands, c);
    keep(commands, c);
  });
}

void WssrUnbiasedIntegrator::end_pass(Commands& commands, int preparation) {
  ReservoirStore& store = context_.reservoirs;
  if (builds_tree(preparation)) {
    store.records = RecordCells::of_tree(context_.device, points_, params_.points_per_leaf, params_.reservoirs_per_cell,
                                         context_.threads);
    points_ = {};
    start_cells(commands, Kept::kNothing);
    return;
  }
  commands.begin_stage("cells");
  Queue& touched = store.records->touched();
  stages_.prepare(commands, &touched, RayKind::kNone, nullptr);
  stages_.dispatch(commands, update_, touched);
  stages_.prepare(commands, nullptr, RayKind::kNone, &touched);
  commands.flush();
  store.records->has_history = true;
  context_.wave.params().reuse.pass = ++store.passes;
  // The tree was built over what the camera sees: places that bounces see are added in the first passes.
  ++passes_;
  if (tree() && preparation < 0 && passes_ <= kFirstPasses && (passes_ & (passes_ - 1)) == 0 &&
      context_.settings.max_bounces > 0)
    store.records->follow(context_.device, survey(commands), rules());
}

void WssrUnbiasedIntegrator::sample(Commands& commands, std::size_t c) {
  Queue& surfaces = stages_.surfaces(c);
  commands.begin_stage("candidates");
  stages_.dispatch(commands, candidates_, surfaces);
  commands.begin_stage("cells");
  stages_.dispatch(commands, offer_, surfaces);
}

void WssrUnbiasedIntegrator::keep(Commands& commands, std::size_t c) {
  commands.begin_stage("cells");
  stages_.dispatch(commands, winner_, stages_.surfaces(c));
}

bool WssrUnbiasedIntegrator::render(Commands& commands) {
  return stages_.render(commands, [&](std::size_t c) {
    sample(commands, c);
    if (!params_.temporal_reuse) keep(commands, c);
    commands.begin_stage("reuse");
    stages_.dispatch(commands, merge_, stages_.surfaces(c));
    if (params_.temporal_reuse) keep(commands, c);
  });
}

}  // namespace hw

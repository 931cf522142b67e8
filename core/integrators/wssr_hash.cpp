// SPDX-License-Identifier: Apache-2.0
// The stages of `wssr-hash`, beside those of path:
//   surface → shade (→ request) → trace shadow → resolve …   and after a pass: update, insert
// `shade` draws lights by the surface's cell, `resolve` teaches it. Where that was found not to pay, lights are drawn
// by the tree and no cell is asked: then it is `path`. Cells change between passes only, so that a pass gives the same
// picture in any order of waves and threads.
#include "integrators/wssr_hash.h"

#include <algorithm>
#include <bit>
#include <string>

#include "lib/sampler.h"
#include "stages/reuse_wave.h"

namespace hw {

namespace {

constexpr float kCellPixels = 16;  // width of a cell in the picture
constexpr float kFloor = 0.02f;    // of what a node is thought to give, over what nodes give in the mean
constexpr std::uint32_t kKeepPasses = 64;
// Before the first sample cells learn from some paths, so that no sample is wasted on what nothing is known of: rounds
// as cuts take some to follow the light, each with a path for one pixel of so many.
constexpr int kRounds = 4, kRoundsKept = 1;
constexpr int kRoundsByTree = 2;            // after those, to compare; and as many with one light sample
constexpr std::uint32_t kFramesByTree = 8;  // that go by before it is found out anew whether cells pay
constexpr std::uint32_t kRoundPixels = 16;
constexpr std::uint32_t kLearnEach = 8;
constexpr float kGuessedResponse =
    0.125f;                          // of a surface that nothing is known of: albedo over pi, half of it in shadow
constexpr float kLeastSize = 1e-4f;  // of the scene's radius

}  // namespace

WssrHashIntegrator::WssrHashIntegrator(const IntegratorContext& context)
    : context_(context),
      params_(resolve_reuse(context.settings)),
      missing_(context.device, context.wave.capacity(), "missing light cells"),
      request_(context.kernels.get("light_cell_request", context.constants)),
      update_(context.kernels.get("light_cell_update", context.constants)),
      insert_(context.kernels.get("light_cell_insert", context.constants)),
      clear_(context.kernels.get("light_cell_clear", context.constants)),
      refit_(context.kernels.get("light_cell_refit", context.constants)) {
  const auto make = [&](std::uint64_t element, const char* label) {
    return std::make_unique<Buffer>(context.device, element * context.wave.capacity(), BufferUse::device, label);
  };
  wanted_ = make(sizeof(LightCellRequest), "wanted light cells");
  visited_ = make(sizeof(std::uint32_t), "visited light cells");
}

void WssrHashIntegrator::begin_frame(Commands& commands) {
  ReservoirStore& store = context_.reservoirs;
  const RenderSettings& s = context_.settings;
  const std::string kind = s.integrator + " " + std::to_string(params_.reservoir_memory);
  const auto found_out_anew = [&] {
    return store.light_cells->by_tree && !s.resume && store.light_cells->frames + 1 >= kFramesByTree;
  };
  const bool keeps = (s.continue_history || s.resume) && store.kind == kind && store.light_cells &&
                     store.light_cells->tree == context_.light_tree_revision && !found_out_anew();
  if (store.kind != kind || !store.light_cells) {
    store.clear();
    store.kind = kind;
    store.light_cells =
        std::make_unique<LightCells>(context_.device, std::uint64_t(params_.reservoir_memory) * 1024 * 1024);
  }
  const bool moved = keeps && store.light_cells->fit != context_.light_tree_fit;
  store.light_cells->tree = context_.light_tree_revision;
  store.light_cells->fit = context_.light_tree_fit;
  const float unit_ratio = store.light_cells->unit / context_.light_tree_unit;
  store.light_cells->unit = context_.light_tree_unit;
  if (!keeps) store.light_cells->passes = store.light_cells->frames = 0;
  if (keeps && !s.resume) ++store.light_cells->frames;
  if (!keeps) cells().by_tree = cells().one_light_sample = false;
  if (cells().one_light_sample && !s.reuse.light_samples) context_.wave.params().light_samples = 1;
  preparations_ = s.resume || cells().by_tree ? 0 : keeps ? kRoundsKept : kRounds;
  begin_splitting(keeps);

  FrameParams& frame = context_.wave.params();
  LightCellFrame& f = frame.light_cells;
  cells().fill(f);
  f.missing = missing_.address();
  f.wanted = wanted_->address();
  f.visited = visited_->address();
  f.pass = cells().passes;
  f.size = kCellPixels * context_.pixel_size;
  f.least_size = kLeastSize * context_.scene_radius;
  f.floor = kFloor;
  f.keep = kKeepPasses;
  f.unit = kGuessedResponse * context_.light_tree_unit;
  context_.wave.write_params(commands);

  commands.begin_stage("light cells");
  dispatch_all(commands, context_.device, clear_, cells().buckets(), keeps ? 0 : 1);
  if (moved) dispatch_all(commands, context_.device, refit_, cells().count(), std::bit_cast<std::uint32_t>(unit_ratio));
  stages(LightSource::kCells).prepare(commands, nullptr, RayKind::kNone, &missing_);
  commands.flush();
}

// Animations mostly have one seed for all frames. Cells that knew what a sample's own numbers brought in the frame
// before would favour it: that is a bias, however independent the samples of a frame are.
std::uint32_t WssrHashIntegrator::seed(std::uint32_t given) const {
  const std::uint32_t frames = context_.reservoirs.light_cells->frames;
  return frames == 0 ? given : sampler_hash_combine(given, frames);
}

std::uint32_t WssrHashIntegrator::preparation_pixels() const { return kRoundPixels; }

// Rounds by the tree look at the pixels of the two before them.
int WssrHashIntegrator::preparation_set(int preparation) const { return std::min(preparation, kRounds - 1) / 2; }

PathStages& WssrHashIntegrator::stages(LightSource source) {
  const bool reuse = context_.wave.places() > context_.wave.bounce_samples();
  std::optional<PathStages>& found = stages_[source == LightSource::kDrawn][reuse];
  if (!found) found.emplace(with_path_reuse(context_, reuse), source);
  return *found;
}

// How many paths go on from a surface, and whether pixels share them, is measured by the last two of the rounds before
// a first sample, and kept with the cells; so is whether cells pay, by two more in which lights are drawn by the tree.
void WssrHashIntegrator::begin_splitting(bool keeps) {
  LightCells& c = cells();
  const bool can_reuse = context_.wave.path_reuse(), asked = context_.settings.reuse.path_reuse.has_value();
  if (!keeps) c.bounce_samples = 1, c.path_reuse = false;
  const bool measures = preparations_ == kRounds && !params_.bounce_samples;
  if (params_.bounce_samples) c.bounce_samples = params_.bounce_samples;
  if (asked || !can_reuse) c.path_reuse = can_reuse;
  context_.wave.set_bounce_samples(measures ? 1 : c.bounce_samples, preparations_ == 0 && c.path_reuse);
  if (!measures) return;
  const std::uint32_t pixels = (context_.width * context_.height + kRoundPixels - 1) / kRoundPixels;
  splitting_.emplace(context_, pixels);
  if (pixels >= kFewestCompared) preparations_ += kRoundsByTree;
}

bool WssrHashIntegrator::prepare(Commands& commands, int preparation) {
  if (preparation >= kRounds) {
    if (!paths(commands, true, true)) return false;
    const int which = preparation - kRounds;
    if (which < kRoundsByTree)
      splitting_->measure_tree(commands, std::uint32_t(which));
    else
      splitting_->measure_one_light_sample(commands, std::uint32_t(which - kRoundsByTree));
    return true;
  }
  if (!paths(commands, cells().by_tree, true)) return false;
  const int which = preparation - (kRounds - 2);
  if (splitting_ && which >= 0) splitting_->measure(commands, std::uint32_t(which));
  return true;
}

bool WssrHashIntegrator::render(Commands& commands) { return paths(commands, cells().by_tree, false); }

// One wave of them. In preparations there is a path here and there, and nobody to share with.
bool WssrHashIntegrator::paths(Commands& commands, bool by_tree, bool preparing) {
  PathStages& s = stages(by_tree ? LightSource::kDrawn : LightSource::kCells);
  s.shares = !preparing;
  if (!by_tree) {
    s.after_shading = [&] {
      s.prepare(commands, &missing_, RayKind::kNone, nullptr);
      s.dispatch(commands, request_, missing_);
      s.prepare(commands, nullptr, RayKind::kNone, &missing_);
    };
  }
  return s.render(commands, [](std::size_t) {});
}

// After the first two: whether it is the tree that draws. If so, and nobody asked for a number of light samples, after
// two more: whether one does.
void WssrHashIntegrator::end_round_by_tree(Commands& commands, int round) {
  FrameParams& frame = context_.wave.params();
  if (round == kRoundsByTree - 1) {
    cells().by_tree = splitting_->chooses_tree(commands);
    const bool goes_on = cells().by_tree && !context_.settings.reuse.light_samples && frame.light_samples > 1;
    if (goes_on) {
      preparations_ += kRoundsByTree;
      frame.light_samples = 1;
      return;
    }
  } else if (round == 2 * kRoundsByTree - 1) {
    cells().one_light_sample = splitting_->chooses_one_light_sample(commands);
    if (!cells().one_light_sample) frame.light_samples = context_.wave.light_samples();
  } else {
    return;
  }
  splitting_.reset();
}

// Cells learn after each pass at first, then after every second, fourth, … as one more says ever less of what is known.
bool WssrHashIntegrator::learns_now() {
  const std::uint32_t passes = ++frame_passes_;
  return passes % std::bit_floor(std::max(passes / kLearnEach, 1u)) == 0;
}

void WssrHashIntegrator::end_pass(Commands& commands, int preparation) {
  end_round(commands, preparation);
  if (preparation >= 0 && preparation + 1 == preparations_)  // the picture's own samples come next
    context_.wave.set_bounce_samples(cells().bounce_samples, cells().path_reuse);
}

void WssrHashIntegrator::end_round(Commands& commands, int preparation) {
  FrameParams& frame = context_.wave.params();
  if (preparation >= kRounds) return end_round_by_tree(commands, preparation - kRounds);
  if (cells().by_tree) return;
  if (learns_now()) {
    commands.begin_stage("light cells");
    dispatch_all(commands, context_.device, update_, cells().count());
    dispatch_all(commands, context_.device, insert_, cells().buckets());
    commands.flush();
  }
  frame.light_cells.pass = ++cells().passes;
  if (!splitting_) return;
  if (preparation == kRounds - 3)
    context_.wave.set_bounce_samples(PathSplitting::kMeasured, context_.wave.path_reuse());
  if (preparation == kRounds - 1) {
    const PathChoice best = splitting_->choose(commands, context_.settings.reuse.path_reuse.value_or(false));
    cells().bounce_samples = best.bounce_samples;
    cells().path_reuse = best.reuse;
    context_.wave.set_bounce_samples(1, false);
    if (preparations_ == kRounds) splitting_.reset();
  }
}

}  // namespace hw

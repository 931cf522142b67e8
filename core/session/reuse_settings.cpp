// SPDX-License-Identifier: Apache-2.0
// The integrators by name, what each reads, and the checks of what was asked.
#include "session/reuse_settings.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "session/settings.h"

namespace hw {

namespace {

using Names = std::vector<std::string>;

Names joined(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Defaults are the paper's (section 5); what it leaves open is its code's, or said beside the member.
std::vector<IntegratorInfo> make_table() {
  ReuseParams restir;
  restir.visibility_reuse = true;
  restir.history = 20;  // the paper has none; Bitterli et al. 2020's
  ReuseParams reproject = restir;
  reproject.neighbours = 3;
  ReuseParams kd;
  kd.candidates = kd.indirect_candidates = 1;
  kd.neighbours = 3;
  ReuseParams grid = kd;
  const Names screen = {"candidates",    "indirect_candidates", "neighbours",    "reuse_radius", "temporal_reuse",
                        "spatial_reuse", "visibility_reuse",    "reuse_weights", "history"};
  const Names world = {"candidates",     "indirect_candidates", "neighbours", "reservoirs_per_cell",
                       "temporal_reuse", "spatial_reuse",       "history",    "empty_cells"};
  ReuseParams hash;
  hash.light_samples = 4;
  hash.path_reuse = true;
  const Names grids = joined(world, {"grid_radius", "grid_resolution", "grid_extent", "cell_inputs", "grid_follow"});
  // Unbiased estimators: records are weighed by surfaces, so that they need neither inputs nor what lights empty cells.
  const Names shared = {"candidates", "indirect_candidates", "neighbours", "temporal_reuse", "spatial_reuse",
                        "history",    "mis_weights"};
  const Names screen_unbiased = joined(shared, {"reuse_radius"});
  const Names world_unbiased = joined(shared, {"reservoirs_per_cell"});
  const Names grid_unbiased = joined(world_unbiased, {"grid_radius", "grid_resolution", "grid_extent"});
  auto unbiased = [](ReuseParams p) {
    p.unbiased = true;
    p.weights = ReuseWeights::kMis;
    p.visibility_reuse = false;
    // Longer memory makes one pass better and their mean worse: passes then resemble each other.
    p.temporal_reuse = false;
    p.history = 20;
    return p;
  };
  ReuseParams screen_defaults = unbiased(restir);
  ReuseParams reproject_defaults = unbiased(reproject);
  ReuseParams kd_defaults = unbiased(kd);
  kd_defaults.candidates = 32;
  kd_defaults.indirect_candidates = 8;
  kd_defaults.neighbours = 5;
  kd_defaults.ascension = 4;
  kd_defaults.points_per_leaf = 4;
  ReuseParams grid_defaults = kd_defaults;
  grid_defaults.grid_radius = 1;
  return {
      {"path",
       "Path Tracing",
       "Light samples by a light tree and one bounce at each surface. Unbiased; the reference.",
       {"light_samples", "bounce_samples", "path_reuse"},
       {}},
      {"restir", "ReSTIR",
       "Reuses light samples of earlier passes and of nearby pixels at the first surface. Much cleaner under many "
       "lights; as the paper has it biased at edges.",
       screen, restir, screen_unbiased, screen_defaults},
      {"restir-reproject", "ReSTIR + Reprojection",
       "ReSTIR that also looks up the reservoirs of the picture for surfaces seen after a bounce.", screen, reproject,
       screen_unbiased, reproject_defaults},
      {"wssr-kd", "World-Space k-d Tree",
       "Keeps light samples in the leaves of a tree over the picture's surfaces, for every bounce. As the paper has it "
       "biased, with visible cells.",
       joined(world, {"ascension", "points_per_leaf"}), kd, joined(world_unbiased, {"ascension", "points_per_leaf"}),
       kd_defaults},
      {"wssr-grid", "World-Space Grid",
       "Keeps light samples in a grid about the camera, for every bounce; no reuse beyond the grid. As the paper has "
       "it "
       "biased.",
       grids, grid, grid_unbiased, grid_defaults},
      {"wssr-grid-reproject", "World-Space Grid + Reprojection",
       "The grid, used also by surfaces beyond it through its nearest cells.", grids, grid, grid_unbiased,
       grid_defaults},
      {"wssr-hash",
       "World-Space Hash",
       "Learns in world space which lights arrive where, and samples those, at every bounce. Unbiased; path tracing "
       "where lights are few.",
       {"light_samples", "bounce_samples", "path_reuse", "reservoir_memory"},
       hash},
  };
}

[[noreturn]] void bad(const std::string& what) { throw std::invalid_argument(what); }

template <class T>
std::string text(T value) {
  std::string s = std::to_string(value);
  if constexpr (std::is_floating_point_v<T>) s.erase(s.find_last_not_of('0') + 1);
  return s;
}

}  // namespace

const std::vector<IntegratorInfo>& integrator_table() {
  static const std::vector<IntegratorInfo> table = make_table();
  return table;
}

const IntegratorInfo* find_integrator(const std::string& name) {
  for (const IntegratorInfo& info : integrator_table())
    if (info.name == name) return &info;
  return nullptr;
}

ReuseParams resolve_reuse(const RenderSettings& s) {
  const IntegratorInfo* info = find_integrator(s.integrator);
  if (!info) {
    std::string known;
    for (const IntegratorInfo& i : integrator_table()) known += (known.empty() ? "" : ", ") + i.name;
    bad("there is no integrator named '" + s.integrator + "'; the integrators are " + known);
  }
  const ReuseSettings& r = s.reuse;
  if (r.estimator != "paper" && r.estimator != "unbiased")
    bad("there is no estimator '" + r.estimator + "' for the integrator '" + s.integrator +
        "'; the estimators are paper, unbiased");
  const bool unbiased = r.estimator == "unbiased" && !info->unbiased_parameters.empty();
  const Names& read = unbiased ? info->unbiased_parameters : info->parameters;
  ReuseParams p = unbiased ? info->unbiased : info->defaults;
  // A parameter that the integrator does not read is refused where it stands in a command, not silently dropped.
  auto given = [&](const char* name, const auto& value) {
    if (!value) return false;
    if (std::find(read.begin(), read.end(), name) == read.end())
      bad("the integrator '" + s.integrator + "' has no parameter '" + name + "'" +
          (info->unbiased_parameters.empty() ? "" : " with the estimator '" + r.estimator + "'"));
    return true;
  };
  auto whole = [&](const char* name, const std::optional<std::uint32_t>& value, std::uint32_t least, std::uint32_t most,
                   std::uint32_t& out) {
    if (!given(name, value)) return;
    if (*value < least || *value > most)
      bad(std::string(name) + " must be from " + text(least) + " to " + text(most) + ", not " + text(*value));
    out = *value;
  };
  auto number = [&](const char* name, const std::optional<float>& value, float least, float most, float& out) {
    if (!given(name, value)) return;
    if (!(*value >= least && *value <= most))
      bad(std::string(name) + " must be from " + text(least) + " to " + text(most) + ", not " + text(*value));
    out = *value;
  };
  auto choice = [&](const char* name, const std::optional<std::string>& value, const Names& choices, auto&& take) {
    if (!given(name, value)) return;
    const auto at = std::find(choices.begin(), choices.end(), *value);
    std::string known;
    for (const std::string& c : choices) known += (known.empty() ? "" : ", ") + c;
    if (at == choices.end()) bad("there is no " + std::string(name) + " '" + *value + "'; choices are " + known);
    take(std::uint32_t(at - choices.begin()));
  };
  whole("candidates", r.candidates, 1, 1024, p.candidates);
  whole("indirect_candidates", r.indirect_candidates, 1, 1024, p.indirect_candidates);
  whole("neighbours", r.neighbours, 0, 64, p.neighbours);
  number("reuse_radius", r.reuse_radius, 0, 1, p.reuse_radius);
  whole("ascension", r.ascension, 0, 1000, p.ascension);  // beyond the tree: up to its root
  whole("grid_radius", r.grid_radius, 0, 1000, p.grid_radius);
  whole("grid_resolution", r.grid_resolution, 1, 512, p.grid_resolution);
  number("grid_extent", r.grid_extent, 1e-3f, 1e6f, p.grid_extent);
  whole("cell_inputs", r.cell_inputs, 0, 1u << 20, p.cell_inputs);
  whole("points_per_leaf", r.points_per_leaf, 1, 1u << 20, p.points_per_leaf);
  whole("reservoirs_per_cell", r.reservoirs_per_cell, 1, 16, p.reservoirs_per_cell);
  whole("light_samples", r.light_samples, 1, 64, p.light_samples);
  whole("bounce_samples", r.bounce_samples, 0, 64, p.bounce_samples);
  whole("reservoir_memory", r.reservoir_memory, 1, 1u << 16, p.reservoir_memory);
  // Without an end of its history a reservoir freezes, and the picture's error with it.
  whole("history", r.history, unbiased ? 1 : 0, unbiased ? 1000 : 1u << 20, p.history);
  if (given("path_reuse", r.path_reuse)) p.path_reuse = *r.path_reuse;
  if (given("temporal_reuse", r.temporal_reuse)) p.temporal_reuse = *r.temporal_reuse;
  if (given("spatial_reuse", r.spatial_reuse)) p.spatial_reuse = *r.spatial_reuse;
  choice("reuse_weights", r.reuse_weights, {"1/M", "1/Z", "mis"},
         [&](std::uint32_t i) { p.weights = ReuseWeights(i); });
  choice("mis_weights", r.mis_weights, {"pairwise", "balance"},
         [&](std::uint32_t i) { p.weights = i == 0 ? ReuseWeights::kMis : ReuseWeights::kBalance; });
  // A stored sample that was found occluded stands for fewer places than its weights say: MIS weights would be biased
  // by it, so that they come without unless asked for.
  if (p.weights == ReuseWeights::kMis) p.visibility_reuse = false;
  if (given("visibility_reuse", r.visibility_reuse)) p.visibility_reuse = *r.visibility_reuse;
  choice("grid_follow", r.grid_follow, {"world", "camera"}, [&](std::uint32_t i) { p.grid_rides = i == 1; });
  choice("empty_cells", r.empty_cells, {"canonical", "black"}, [&](std::uint32_t i) { p.black_where_empty = i == 1; });
  return p;
}

}  // namespace hw

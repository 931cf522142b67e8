// SPDX-License-Identifier: Apache-2.0
// What reservoir integrators are asked for: the parameters of the paper (wssr), each unset unless the user says
// otherwise, and what they come to for one integrator. docs/manual/reuse.md says what each does to the picture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hw {

struct ReuseSettings {
  std::string estimator = "paper";          // "unbiased": MIS weights alone, with a canonical sample at every surface
  std::optional<std::uint32_t> candidates;  // M: light candidates at the first surface
  std::optional<std::uint32_t> indirect_candidates;  // at later surfaces
  std::optional<std::uint32_t> neighbours;           // k
  std::optional<float> reuse_radius;             // restir: of spatial neighbours, share of the picture's smaller side
  std::optional<std::uint32_t> ascension;        // wssr-kd: L, levels of the tree
  std::optional<std::uint32_t> grid_radius;      // wssr-grid: L, cells
  std::optional<std::uint32_t> grid_resolution;  // cells along each axis
  std::optional<float> grid_extent;              // half the grid's side [m]
  std::optional<std::uint32_t> cell_inputs;      // samples a cell takes in one pass over the picture; 0: all
  std::optional<std::uint32_t> points_per_leaf;  // wssr-kd
  std::optional<std::uint32_t> reservoirs_per_cell;  // of a leaf or a cell
  std::optional<std::uint32_t> history;  // most passes over the picture that a reservoir remembers; 0: all of them
  std::optional<std::uint32_t>
      bounce_samples;                          // path, wssr-hash: paths that go on from the first surface; 0: what pays
  std::optional<std::uint32_t> light_samples;  // path, wssr-hash: at what the camera sees first
  std::optional<std::uint32_t> reservoir_memory;  // wssr-hash: of all cells [MiB]
  std::optional<bool> path_reuse;  // path, wssr-hash: pixels share what their paths find at the surface after the first
  std::optional<bool> temporal_reuse, spatial_reuse, visibility_reuse;
  std::optional<std::string> reuse_weights;  // "1/M", "1/Z", "mis"
  std::optional<std::string> mis_weights;    // unbiased: "pairwise", "balance"
  std::optional<std::string> grid_follow;    // "world": cells stay in place; "camera": they ride along, as the paper's
  std::optional<std::string> empty_cells;    // without a neighbour: "canonical" sample, or "black" as the paper's code
};

enum class ReuseWeights : std::uint32_t { kInverseM = 0, kInverseZ = 1, kMis = 2, kBalance = 3 };

// All of it decided.
struct ReuseParams {
  std::uint32_t candidates = 32, indirect_candidates = 8, neighbours = 5;
  float reuse_radius = 0.1f;
  std::uint32_t ascension = 10, grid_radius = 10, grid_resolution = 100;
  float grid_extent = 50;
  std::uint32_t cell_inputs = 100, points_per_leaf = 1, reservoirs_per_cell = 1, history = 0;
  std::uint32_t reservoir_memory = 64, light_samples = 1, bounce_samples = 0;
  bool path_reuse = false;
  bool temporal_reuse = true, spatial_reuse = true, visibility_reuse = false;
  ReuseWeights weights = ReuseWeights::kInverseM;
  bool grid_rides = false, black_where_empty = false;
  bool unbiased = false;  // the estimator; weights are then MIS's
};

struct RenderSettings;

// What an integrator is, for menus, help and panels.
struct IntegratorInfo {
  std::string name, label, description;
  std::vector<std::string> parameters;  // names of ReuseSettings' members that it reads
  ReuseParams defaults;
  // The same with the estimator `unbiased`. Without parameters: there is one estimator, whatever its name.
  std::vector<std::string> unbiased_parameters = {};
  ReuseParams unbiased = {};
};
const std::vector<IntegratorInfo>& integrator_table();
const IntegratorInfo* find_integrator(const std::string& name);  // null when there is none

// Throws std::invalid_argument naming the setting that is out of range, unknown, or not read by the integrator.
ReuseParams resolve_reuse(const RenderSettings& settings);

// Bytes that the reservoirs of these settings take, as they are allocated.
std::uint64_t reservoir_bytes(const std::string& integrator, const ReuseParams& params, std::uint32_t width,
                              std::uint32_t height);

}  // namespace hw

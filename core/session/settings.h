// SPDX-License-Identifier: Apache-2.0
// What a render is asked for. Names and defaults follow Cycles where it has them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "session/reuse_settings.h"

namespace hw {

struct RenderSettings {
  std::uint32_t width = 0, height = 0;  // full frame, pixels
  std::array<std::uint32_t, 4> region{0, 0, 0,
                                      0};  // x0, y0, x1, y1 (exclusive), bottom-left origin; all 0 = full frame
  std::uint32_t samples = 64;
  std::uint32_t first_sample = 0;  // sample ranges of one render can be made apart and merged
  std::uint32_t seed = 0;
  bool adaptive_sampling = false;  // `samples` at most, fewer where less noise is left; not by reservoir integrators
  float noise_threshold = 0;       // with it: ends once the picture's relative error is this small everywhere; 0: never
  std::uint32_t adaptive_min_samples = 0;  // before that
  double time_limit = 0;                   // seconds, 0 = none; at least one sample is finished
  std::string integrator = "path";
  std::string lights = "auto";  // how lights are chosen: "uniform", "power", "tree"; "auto": the tree where it pays
  std::uint32_t max_bounces = 12, diffuse_bounces = 4, glossy_bounces = 4, transmission_bounces = 12;
  std::uint32_t transparent_bounces = 8;
  std::uint32_t min_bounces = 0;               // before Russian roulette
  float clamp_direct = 0, clamp_indirect = 0;  // 0 = off
  float filter_glossy = 0;
  bool caustics_reflective = true, caustics_refractive = true;
  std::string filter = "BLACKMAN_HARRIS";  // or "GAUSSIAN", "BOX"
  float filter_width = 1.5f;               // pixels
  bool transparent_film = false;
  bool transparent_glass = false;
  float exposure = 1;
  float mist_start = 5, mist_depth = 25;
  std::string mist_falloff = "QUADRATIC";  // "LINEAR", "INVERSE_QUADRATIC"
  float pass_alpha_threshold = 0.5f;
  std::uint32_t tile_pixels = 0;  // 0 = chosen by memory; the image does not depend on it
  std::vector<std::string> passes{"Combined"};
  ReuseSettings reuse;  // of reservoir integrators
  bool resume = false;  // the session's last picture goes on where it ended; `samples` is what it will have in all
  bool continue_history = false;  // reservoirs of the session's last render go on: the next frame of an animation
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Rays a second of a Tracer beside a plain Embree loop on the same rays, triangles and threads, in one run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/device.h"

namespace hw {

struct TracerBenchOptions {
  std::vector<std::uint32_t> triangles = {20'000, 320'000, 2'900'000};
  std::uint32_t rays = 1u << 19;  // a repeat
  int repeats = 7;                // medians are of these; the contestants take turns
};

// Millions of rays a second, medians.
struct TracerBenchRow {
  std::uint32_t triangles;
  bool coherent;                    // rays of one camera in scanline order; else random origins and directions
  double closest, any;              // the Tracer, through its queue, ray and hit buffers
  double plain_closest, plain_any;  // rtcIntersect1 and rtcOccluded1 over an array, on one scene of one level, robust
  double fast_closest, fast_any;    // the same without RTC_SCENE_FLAG_ROBUST, whose edges leak
  double ratio_closest() const { return closest / plain_closest; }
  double ratio_any() const { return any / plain_any; }
};

// `kind` and `threads` as make_tracer() takes them; the plain loop has as many threads. The scene is a bumpy sphere.
// Throws what make_tracer() throws, and OutOfMemory.
std::vector<TracerBenchRow> tracer_benchmark(Device& device, const std::string& kind, int threads,
                                             const TracerBenchOptions& options = {});

}  // namespace hw

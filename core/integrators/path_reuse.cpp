// SPDX-License-Identifier: Apache-2.0
// Dispatches of path reuse.
#include "integrators/path_reuse.h"

#include <algorithm>

#include "integrators/path_stages.h"

namespace hw {

PathReuse::PathReuse(const IntegratorContext& context)
    : context_(context),
      pairs_(context.kernels.get("path_pairs", context.constants)),
      weigh_(context.kernels.get("path_weigh", context.constants)),
      gather_(context.kernels.get("path_gather", context.constants)),
      prepare_(context.kernels.get("queue_prepare")) {}

void PathReuse::share(Commands& commands) {
  Wave& w = context_.wave;
  const std::uint32_t anchors = w.params().wave_pixels, ways = w.bounce_samples();
  const auto prepare = [&](Push push) { commands.dispatch(prepare_, push.bytes(), 1); };
  commands.begin_stage("path reuse");
  prepare({.out_queue = w.shared_queue->address(), .a = std::uint32_t(RayKind::kNone)});
  dispatch_all(commands, context_.device, pairs_, anchors * ways * HW_REUSE_PIXELS, ways, w.shared_queue->address());
  prepare({.queue = w.shared_queue->address(), .a = std::uint32_t(RayKind::kShadow)});
  context_.tracer.any(
      commands, {&w.shared_queue->buffer, w.shared_rays.get(), w.shared_hits.get(), w.capacity() * HW_REUSE_PIXELS});
  commands.begin_stage("path reuse");
  dispatch_all(commands, context_.device, weigh_, anchors * ways, ways);
  dispatch_all(commands, context_.device, gather_, anchors, ways);
}

std::uint32_t reuse_wave_pixels(std::uint32_t width, bool adaptive) {
  return adaptive ? HW_REUSE_TILE : HW_REUSE_TILE_ROWS * width;
}

std::uint32_t most_ways_with_reuse(std::uint32_t width) {
  constexpr std::uint32_t kPlaces = 1u << 16;
  return std::max(kPlaces / reuse_wave_pixels(width, false), 2u) - 1;
}

}  // namespace hw

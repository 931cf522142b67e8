// SPDX-License-Identifier: Apache-2.0
// What a render cost, as JSON for --stats and the add-on's statistics panel.
#pragma once

#include <cstdint>
#include <string>

#include "session/session.h"

namespace hw {

// Light cells of `wssr-hash`: how many there is place for, and how many hold something. 0: there are none.
struct CellUse {
  std::uint32_t count = 0, used = 0;
  bool by_tree = false;              // they were found not to pay: the light tree drew lights
  bool path_reuse = false;           // pixels shared what their paths found
  std::uint32_t bounce_samples = 1;  // paths that went on from the first surface that scatters light
};

// Schema in docs/manual/stats.md.
std::string render_stats_json(const Context& context, const Tracer& tracer, const SyncReport& sync,
                              const Progress& progress, std::uint64_t wave_bytes, std::uint64_t reservoir_bytes,
                              const CellUse& cells);

}  // namespace hw

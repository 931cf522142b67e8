// SPDX-License-Identifier: Apache-2.0
// What a render cost, as JSON for --stats and the add-on's statistics panel.
#pragma once

#include <cstdint>
#include <string>

#include "session/session.h"

namespace hw {

// Schema in docs/manual/stats.md.
std::string render_stats_json(const Context& context, const Tracer& tracer, const SyncReport& sync,
                              const Progress& progress, std::uint64_t wave_bytes, std::uint64_t reservoir_bytes);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Tracer on the host through Embree (3.13 or 4): reads and writes the mapped ray and hit buffers in place.
#pragma once

#include <memory>

#include "trace/tracer.h"

namespace hw {

std::unique_ptr<Tracer> make_embree_tracer(Device& device, int threads);

}  // namespace hw

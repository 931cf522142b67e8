// SPDX-License-Identifier: Apache-2.0
// A render's settings from a Python dictionary.
#pragma once

#include <nanobind/nanobind.h>

#include "session/settings.h"

namespace hw::python {

// Keys are the names of RenderSettings' members, and "mist" for (start, depth, falloff). ValueError for an unknown key
// or a number out of range, TypeError for a value of the wrong type; both name the key.
RenderSettings take_settings(const nanobind::dict& settings);

}  // namespace hw::python

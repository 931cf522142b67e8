// SPDX-License-Identifier: Apache-2.0
// Reservoirs that a session keeps from one frame to the next.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "reservoirs/screen_reservoirs.h"

namespace hw {

struct ReservoirStore {
  std::string integrator;  // that they are for
  std::unique_ptr<ScreenReservoirs> screen;

  std::uint64_t bytes() const { return screen ? screen->bytes() : 0; }
  void clear() {
    integrator.clear();
    screen.reset();
  }
};

}  // namespace hw

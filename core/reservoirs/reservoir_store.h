// SPDX-License-Identifier: Apache-2.0
// Reservoirs that a session keeps from one frame to the next.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "reservoirs/cell_reservoirs.h"
#include "reservoirs/light_cells.h"
#include "reservoirs/record_cells.h"
#include "reservoirs/screen_reservoirs.h"

namespace hw {

struct ReservoirStore {
  std::string kind;          // the integrator and the settings that decide about layout; others start anew
  std::uint32_t passes = 0;  // of the frames since it was started
  std::unique_ptr<ScreenReservoirs> screen;
  std::unique_ptr<CellReservoirs> cells;
  std::unique_ptr<RecordCells> records;
  std::unique_ptr<LightCells> light_cells;

  std::uint64_t bytes() const {
    return (screen ? screen->bytes() : 0) + (cells ? cells->bytes() : 0) + (records ? records->bytes() : 0) +
           (light_cells ? light_cells->bytes() : 0);
  }
  void clear() {
    kind.clear();
    passes = 0;
    screen.reset();
    cells.reset();
    records.reset();
    light_cells.reset();
  }
};

}  // namespace hw

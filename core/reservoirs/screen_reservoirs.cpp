// SPDX-License-Identifier: Apache-2.0
// Buffers of the picture's reservoirs.
#include "reservoirs/screen_reservoirs.h"

namespace hw {

ScreenReservoirs::ScreenReservoirs(Device& device, std::uint32_t width, std::uint32_t height)
    : width_(width), height_(height) {
  for (int i = 0; i < 2; ++i) {
    reservoirs_[i] = std::make_unique<Buffer>(device, sizeof(Reservoir) * std::size_t(width) * height,
                                              BufferUse::device, "screen reservoirs");
    surfaces_[i] = std::make_unique<Buffer>(device, sizeof(ReuseSurface) * std::size_t(width) * height,
                                            BufferUse::device, "screen surfaces");
  }
}

std::uint64_t ScreenReservoirs::bytes() const {
  return reservoirs_[0]->bytes() + reservoirs_[1]->bytes() + surfaces_[0]->bytes() + surfaces_[1]->bytes();
}

void ScreenReservoirs::fill(ReuseFrame& frame) const {
  frame.screen = reservoirs_[current_]->address();
  frame.screen_surfaces = surfaces_[current_]->address();
  frame.next_screen = reservoirs_[current_ ^ 1]->address();
  frame.next_screen_surfaces = surfaces_[current_ ^ 1]->address();
}

void ScreenReservoirs::begin_pass(Commands& commands) {
  // All bits set: HW_NONE as the surface's key.
  commands.fill(*surfaces_[current_ ^ 1], 0, surfaces_[current_ ^ 1]->bytes(), 0xFFFFFFFFu);
}

}  // namespace hw

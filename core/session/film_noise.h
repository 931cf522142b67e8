// SPDX-License-Identifier: Apache-2.0
// How noisy a film of weighted samples is, block by block: what adaptive sampling goes by.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "film/film.h"

namespace hw {

// Of each block of HW_BLOCK_SIDE pixels, row by row from the bottom: the mean over its pixels and channels of the
// square of the difference of the picture of even samples and that of odd ones, relative to the square of the
// brightness about the pixel, of which what is darker than a tenth counts as a tenth (as in relMSE). Every pixel has
// samples of both kinds. `sums`: width * height records of the layout. `exposure`: of what is shown.
std::vector<float> film_noise(std::span<const float> sums, const FilmLayout& layout, std::uint32_t width,
                              std::uint32_t height, float exposure);

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// The film: which passes are kept, where each lies in a pixel's record, their sums over samples, and how they are read.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "shared/path.h"

namespace hw {

struct PassInfo {
  const char* name;   // as Cycles names it
  std::uint32_t bit;  // HW_PASS_*
  int channels;
  bool averaged;  // false: taken from the first sample alone (depth, indices: an average would mean nothing)
  bool exposed;   // scaled by the film's exposure
};
const std::vector<PassInfo>& pass_table();
const PassInfo* find_pass(std::string_view name);  // null when there is none

// Combined is always kept, whether asked for or not.
struct FilmLayout {
  std::vector<const PassInfo*> passes;  // in the order asked for
  std::uint32_t mask = 0;
  std::uint32_t stride = 0;  // floats a pixel of all passes
  std::uint32_t offset[HW_PASS_COUNT] = {};
  bool light_passes = false;  // some pass needs contributions split by lobe
  bool weighted = false;      // samples have weights: adaptive sampling
  // Floats of the film a pixel.
  std::uint32_t pixel_stride() const { return stride + (weighted ? HW_FILM_WEIGHTS : 0); }
  bool split_paths() const;  // paths must carry PathSplit
};
// Throws std::invalid_argument naming an unknown pass and the known ones.
FilmLayout film_layout(const std::vector<std::string>& names);

// How many samples each pixel of a film holds: `samples`, and `extra` more in the pixels before `split`. Films of
// weighted samples know it themselves.
struct SampleCounts {
  std::uint32_t samples = 0;
  std::uint32_t extra = 0;
  std::uint32_t split = 0;
};

class Film {
 public:
  Film(Device& device, const FilmLayout& layout, std::uint32_t width, std::uint32_t height);
  const FilmLayout& layout() const { return layout_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  Buffer& sums() { return *sums_; }
  // Copies the sums to the host (`pixels * pixel_stride` floats).
  void download(std::vector<float>& out);
  // Writes a pass of downloaded sums: width * height * channels floats, bottom row first. A pixel without samples reads
  // as zero.
  void resolve(const std::vector<float>& sums, const PassInfo& pass, const SampleCounts& counts, float exposure,
               float* out) const;
  void clear();

 private:
  Device& device_;
  FilmLayout layout_;
  std::uint32_t width_, height_;
  std::unique_ptr<Buffer> sums_;
};

}  // namespace hw

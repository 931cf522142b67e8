// SPDX-License-Identifier: Apache-2.0
// Pass table and film sums.
#include "film/film.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "lib/camera.h"

namespace hw {

const std::vector<PassInfo>& pass_table() {
  static const std::vector<PassInfo> table = {
      {"Combined", HW_PASS_COMBINED, 4, true, true},
      {"Depth", HW_PASS_DEPTH, 1, false, false},
      {"Position", HW_PASS_POSITION, 3, false, false},
      {"Normal", HW_PASS_NORMAL, 3, true, false},
      {"Vector", HW_PASS_VECTOR, 4, true, false},
      {"UV", HW_PASS_UV, 3, true, false},
      {"Mist", HW_PASS_MIST, 1, true, false},
      {"Object Index", HW_PASS_OBJECT_INDEX, 1, false, false},
      {"Material Index", HW_PASS_MATERIAL_INDEX, 1, false, false},
      {"Denoising Normal", HW_PASS_DENOISING_NORMAL, 3, true, false},
      {"Denoising Albedo", HW_PASS_DENOISING_ALBEDO, 3, true, false},
      {"Denoising Depth", HW_PASS_DENOISING_DEPTH, 1, true, false},
      {"Diffuse Direct", HW_PASS_DIFFUSE_DIRECT, 3, true, true},
      {"Diffuse Indirect", HW_PASS_DIFFUSE_INDIRECT, 3, true, true},
      {"Diffuse Color", HW_PASS_DIFFUSE_COLOR, 3, true, false},
      {"Glossy Direct", HW_PASS_GLOSSY_DIRECT, 3, true, true},
      {"Glossy Indirect", HW_PASS_GLOSSY_INDIRECT, 3, true, true},
      {"Glossy Color", HW_PASS_GLOSSY_COLOR, 3, true, false},
      {"Transmission Direct", HW_PASS_TRANSMISSION_DIRECT, 3, true, true},
      {"Transmission Indirect", HW_PASS_TRANSMISSION_INDIRECT, 3, true, true},
      {"Transmission Color", HW_PASS_TRANSMISSION_COLOR, 3, true, false},
      {"Emission", HW_PASS_EMISSION, 3, true, true},
      {"Environment", HW_PASS_ENVIRONMENT, 3, true, true},
  };
  return table;
}

const PassInfo* find_pass(std::string_view name) {
  for (const PassInfo& p : pass_table())
    if (name == p.name) return &p;
  return nullptr;
}

namespace {

// Light passes are stored as light and divided by their colour pass when read, as Cycles does: so that
// (direct + indirect) * color rebuilds the picture.
const PassInfo* colour_of(const PassInfo& pass) {
  switch (pass.bit) {
    case HW_PASS_DIFFUSE_DIRECT:
    case HW_PASS_DIFFUSE_INDIRECT:
      return find_pass("Diffuse Color");
    case HW_PASS_GLOSSY_DIRECT:
    case HW_PASS_GLOSSY_INDIRECT:
      return find_pass("Glossy Color");
    case HW_PASS_TRANSMISSION_DIRECT:
    case HW_PASS_TRANSMISSION_INDIRECT:
      return find_pass("Transmission Color");
    default:
      return nullptr;
  }
}

}  // namespace

FilmLayout film_layout(const std::vector<std::string>& names) {
  FilmLayout layout;
  auto keep = [&layout](const PassInfo* pass) {
    if (layout.mask & (1u << pass->bit)) return;
    layout.mask |= 1u << pass->bit;
    layout.offset[pass->bit] = layout.stride;
    layout.stride += static_cast<std::uint32_t>(pass->channels);
  };
  keep(find_pass("Combined"));
  for (const std::string& name : names) {
    const PassInfo* pass = find_pass(name);
    if (!pass) {
      std::string known;
      for (const PassInfo& p : pass_table()) known += (known.empty() ? "" : ", ") + std::string(p.name);
      throw std::invalid_argument("there is no pass named '" + name + "'; the passes are " + known);
    }
    keep(pass);
    if (const PassInfo* colour = colour_of(*pass)) {
      keep(colour);
      layout.light_passes = true;
    }
    if (std::find(layout.passes.begin(), layout.passes.end(), pass) == layout.passes.end())
      layout.passes.push_back(pass);
  }
  if (layout.passes.empty()) layout.passes.push_back(find_pass("Combined"));
  return layout;
}

bool FilmLayout::split_paths() const {
  return light_passes ||
         (mask & (1u << HW_PASS_DENOISING_NORMAL | 1u << HW_PASS_DENOISING_ALBEDO | 1u << HW_PASS_DENOISING_DEPTH));
}

Film::Film(Device& device, const FilmLayout& layout, std::uint32_t width, std::uint32_t height)
    : device_(device), layout_(layout), width_(width), height_(height) {
  const std::size_t floats = std::size_t(width) * height * layout.pixel_stride();
  sums_ = std::make_unique<Buffer>(device, std::max<std::size_t>(floats * 4, 16), BufferUse::device, "film");
  clear();
}

void Film::clear() {
  Commands commands(device_);
  commands.fill(*sums_, 0, sums_->bytes(), 0);
  commands.flush();
}

void Film::download(std::vector<float>& out) {
  out.resize(std::size_t(width_) * height_ * layout_.pixel_stride());
  device_.read(*sums_, 0, std::as_writable_bytes(std::span(out)));
}

void Film::resolve(const std::vector<float>& sums, const PassInfo& pass, const SampleCounts& counts, float exposure,
                   float* out) const {
  const std::size_t pixels = std::size_t(width_) * height_;
  const std::uint32_t stride = layout_.pixel_stride(), offset = layout_.offset[pass.bit];
  const PassInfo* colour = colour_of(pass);
  const std::uint32_t colour_offset = colour ? layout_.offset[colour->bit] : 0;
  const int n = pass.channels;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* record = &sums[i * stride];
    const float count =
        layout_.weighted ? record[layout_.stride] : float(counts.samples + (i < counts.split ? counts.extra : 0));
    const float* in = record + offset;
    const float scale = count == 0 ? 0.0f : (pass.averaged ? 1.0f / count : 1.0f) * (pass.exposed ? exposure : 1.0f);
    for (int c = 0; c < n; ++c) {
      float v = in[c] * scale;
      if (colour) {
        const float k = count == 0 ? 0.0f : record[colour_offset + c] / count;
        v = k != 0.0f ? v / k : 0.0f;
      }
      out[i * n + c] = v;
    }
    // Where the first sample met nothing, or a holdout, nothing was written: far away.
    if (pass.bit == HW_PASS_DEPTH && count > 0 && out[i] == 0.0f) out[i] = HW_DEPTH_MISS;
    if (pass.bit == HW_PASS_COMBINED)
      out[i * 4 + 3] = in[3] * (count > 0 ? 1.0f / count : 0.0f);  // alpha is not exposed
  }
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Blocks to the device, noise from it.
#include "session/adaptive_sampling.h"

#include <algorithm>
#include <vector>

#include "session/film_noise.h"

namespace hw {

AdaptiveSampling::AdaptiveSampling(Device& device, Wave& wave, Film& film, const RenderSettings& settings)
    : wave_(wave),
      film_(film),
      plan_(film.width(), film.height(), settings.samples, settings.noise_threshold, settings.adaptive_min_samples),
      blocks_(device, plan_.blocks() * sizeof(SampledBlock), BufferUse::device, "sampled blocks"),
      exposure_(settings.exposure) {}

std::uint32_t AdaptiveSampling::begin_pass(Commands& commands) {
  constexpr std::size_t kOnce = 65536;  // bytes (Commands::update)
  const std::span<const std::byte> bytes = std::as_bytes(std::span(plan_.next_pass()));
  for (std::size_t at = 0; at < bytes.size(); at += kOnce)
    commands.update(blocks_, at, bytes.subspan(at, std::min(kOnce, bytes.size() - at)));
  wave_.params().sampled_blocks = blocks_.address();
  return std::uint32_t(bytes.size() / sizeof(SampledBlock));
}

bool AdaptiveSampling::end_pass(Commands& commands) {
  if (!plan_.wants_noise()) return true;
  commands.flush();
  std::vector<float> sums;
  film_.download(sums);
  plan_.set_noise(film_noise(sums, film_.layout(), film_.width(), film_.height(), exposure_));
  return !plan_.quiet();
}

}  // namespace hw

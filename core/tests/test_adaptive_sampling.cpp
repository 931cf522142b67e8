// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling without a device: what passes take, how noisy films are, and that nothing is biased by it.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "session/adaptive_plan.h"
#include "session/film_noise.h"

using namespace hw;

namespace {

std::uint32_t number(const SampledBlock& b) { return b.sampling & (HW_SAMPLE_ODD - 1); }
float weight(const SampledBlock& b) { return float(1u << (b.sampling >> HW_SAMPLE_WEIGHT_SHIFT)); }
bool odd(const SampledBlock& b) { return (b.sampling & HW_SAMPLE_ODD) != 0; }

FilmLayout weighted_layout() {
  FilmLayout layout = film_layout({"Depth", "Combined"});
  layout.weighted = true;
  return layout;
}

}  // namespace

TEST_CASE("weights of a block's samples add up to the passes, whatever its noise; no sample comes twice") {
  for (std::uint32_t samples : {1u, 2u, 3u, 7u, 8u, 64u, 100u}) {
    AdaptivePlan plan(18, 9, samples, 0, 0);
    REQUIRE(plan.blocks() == 15);
    std::mt19937 random(samples);
    std::vector<double> weights(plan.blocks(), 0);
    std::vector<std::set<std::uint32_t>> numbers(plan.blocks());
    std::size_t taken = 0;
    for (std::uint32_t pass = 1; pass <= samples; ++pass) {
      for (const SampledBlock& b : plan.next_pass()) {
        REQUIRE(b.block < plan.blocks());
        weights[b.block] += weight(b);
        CHECK(weight(b) <= 4);
        CHECK(numbers[b.block].insert(number(b)).second);
        CHECK(number(b) < samples);
        ++taken;
      }
      if (!plan.wants_noise()) continue;
      for (double w : weights) CHECK(w == pass);
      std::vector<float> noise(plan.blocks());
      for (float& n : noise) n = std::exp(8 * std::generate_canonical<float, 24>(random));
      plan.set_noise(noise);
    }
    for (double w : weights) CHECK(w == samples);
    if (samples >= 64) CHECK(double(taken) < 0.9 * samples * plan.blocks());
  }
}

TEST_CASE("blocks alike, or none noisy, take every pass; noisy ones take more than quiet ones") {
  const auto taken = [](const std::vector<float>& noise) {
    AdaptivePlan plan(16, 16, 64, 0, 0);
    std::vector<std::size_t> counts(plan.blocks(), 0);
    for (int pass = 0; pass < 64; ++pass) {
      for (const SampledBlock& b : plan.next_pass()) ++counts[b.block];
      if (plan.wants_noise()) plan.set_noise(noise);
    }
    return counts;
  };
  for (float level : {0.0f, 3.0f})
    for (std::size_t n : taken(std::vector<float>(16, level))) CHECK(n == 64);
  std::vector<float> noise(16, 1e-5f);
  noise[0] = 1;
  const auto counts = taken(noise);
  CHECK(counts[0] == 64);
  CHECK(counts[15] <= 18);  // a quarter, but for the first passes
}

TEST_CASE("a picture below the threshold everywhere is quiet, after its least samples") {
  AdaptivePlan plan(8, 8, 64, 0.1f, 8);
  std::vector<float> noise(plan.blocks());
  std::uint32_t pass = 0;
  while (!plan.quiet() && pass < 64) {
    plan.next_pass();
    ++pass;
    // The difference of two means of pass / 2 samples whose variance is 0.04: an error of 0.2 / sqrt(pass).
    for (float& n : noise) n = 0.04f * 4 / float(pass);
    if (plan.wants_noise()) plan.set_noise(noise);
  }
  CHECK(pass == 8);
  noise[2] = std::numeric_limits<float>::infinity();  // tells nothing, and is no reason to go on for ever
  AdaptivePlan other(8, 8, 16, 0.1f, 0);
  for (int i = 0; i < 2; ++i) other.next_pass();
  other.set_noise(noise);
  CHECK(other.next_pass().size() <= other.blocks());
}

TEST_CASE("samples that come by their own noise have the expectation of all of them") {
  // Pixels of which one sample in twenty is bright, beside others: what shows noise is sampled more.
  constexpr int kRuns = 8000;
  constexpr std::uint32_t kSamples = 16;
  const FilmLayout layout = weighted_layout();
  const std::uint32_t width = 32, height = 4, stride = layout.pixel_stride(),
                      combined = layout.offset[HW_PASS_COMBINED];
  std::mt19937 random(3);
  double sum = 0, squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    AdaptivePlan plan(width, height, kSamples, 0, 0);
    std::vector<float> film(std::size_t(width) * height * stride, 0.0f);
    for (std::uint32_t pass = 0; pass < kSamples; ++pass) {
      for (const SampledBlock& b : plan.next_pass()) {
        // One light for a block, so that its noise shows in few numbers.
        const float value = b.block == 0 ? (random() % 20 == 0 ? 20.0f : 0.0f) : (random() % 2 ? 0.9f : 1.1f);
        for (std::uint32_t p = 0; p < HW_BLOCK_PIXELS; ++p) {
          const std::uint32_t x = b.block % 8 * HW_BLOCK_SIDE + p % HW_BLOCK_SIDE;
          const std::uint32_t y = b.block / 8 * HW_BLOCK_SIDE + p / HW_BLOCK_SIDE;
          float* record = &film[(y * width + x) * stride];
          float* extra = record + layout.stride;
          for (int c = 0; c < 3; ++c) record[combined + c] += weight(b) * value;
          extra[0] += weight(b);
          if (odd(b)) continue;
          extra[1] += weight(b);
          for (int c = 0; c < 3; ++c) extra[2 + c] += weight(b) * value;
        }
      }
      if (plan.wants_noise()) plan.set_noise(film_noise(film, layout, width, height, 1));
    }
    // Of the noisy block and of a quiet one, by passes, whatever was taken.
    const double mean = (film[combined] + film[film.size() - stride + combined]) / (2 * kSamples);
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kRuns, error = std::sqrt((squares / kRuns - mean * mean) / kRuns);
  CHECK(std::abs(mean - 1) < 4 * error);
}

TEST_CASE("the noise of a film: of known halves, by brightness and exposure, with edges") {
  const FilmLayout layout = weighted_layout();
  const std::uint32_t width = 6, height = 5, stride = layout.pixel_stride(), combined = layout.offset[HW_PASS_COMBINED];
  std::vector<float> film(std::size_t(width) * height * stride, 0.0f);
  const auto fill = [&](std::uint32_t x, std::uint32_t y, float even, float odd_half) {
    float* record = &film[(y * width + x) * stride];
    for (int c = 0; c < 3; ++c) {
      record[combined + c] = 2 * even + 6 * odd_half;
      record[layout.stride + 2 + c] = 2 * even;
    }
    record[layout.stride] = 8;
    record[layout.stride + 1] = 2;
  };
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) fill(x, y, 1, 1);
  for (float n : film_noise(film, layout, width, height, 1)) CHECK(n == doctest::Approx(0));
  for (std::uint32_t y = 4; y < 5; ++y)
    for (std::uint32_t x = 4; x < 6; ++x) fill(x, y, 1.6f, 0.8f);  // the mean is 1
  std::vector<float> noise = film_noise(film, layout, width, height, 1);
  REQUIRE(noise.size() == 4);
  CHECK(noise[0] == doctest::Approx(0));
  CHECK(noise[3] == doctest::Approx(0.64 / 1.01));
  noise = film_noise(film, layout, width, height, 0.1f);
  CHECK(noise[3] == doctest::Approx(0.0064 / (0.01 + 0.01)));
  fill(5, 4, std::numeric_limits<float>::quiet_NaN(), 1);
  for (float n : film_noise(film, layout, width, height, 1)) CHECK(std::isfinite(n));
}

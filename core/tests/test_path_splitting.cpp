// SPDX-License-Identifier: Apache-2.0
// How many paths should go on from a surface: variances out of made-up paths, and the choice by variances and costs.
#include <doctest/doctest.h>

#include <limits>
#include <random>
#include <vector>

#include "integrators/path_splitting.h"

using namespace hw;

namespace {

// Paths of `pixels` of the mean light 1, split in three, whose surfaces and bounces have these variances.
std::vector<SplitRecord> made_up(std::size_t pixels, double surfaces, double bounces) {
  std::mt19937 random(7);
  std::normal_distribution<double> surface(0, std::sqrt(surfaces)), bounce(0, std::sqrt(bounces));
  std::vector<SplitRecord> records(pixels);
  for (SplitRecord& r : records)
    for (int which = 0; which < 2; ++which) {
      const double at = surface(random), parts[3] = {bounce(random), bounce(random), bounce(random)};
      r.light[which] = float(1 + at + (parts[0] + parts[1] + parts[2]) / 3);
      r.apart[which] = float((parts[1] - parts[2]) * (parts[1] - parts[2]) / 9);
    }
  return records;
}

}  // namespace

TEST_CASE("variances of surfaces and of bounces are told apart") {
  for (const auto& [surfaces, bounces] : {std::pair{0.01, 0.03}, {0.03, 0.003}, {0.0, 0.02}}) {
    const SplitVariance v = split_variance(made_up(40000, surfaces, bounces));
    // About the mean of 1 weights are a little more than 1 (their mean is of 1 / light squared) and bounded by
    // darkness.
    CHECK(v.bounces == doctest::Approx(bounces).epsilon(0.1));
    CHECK(v.surfaces == doctest::Approx(surfaces).epsilon(0.1).scale(0.01));
  }
}

TEST_CASE("light that is not finite, black pictures and too few pixels say nothing") {
  std::vector<SplitRecord> records = made_up(1000, 0.01, 0.03);
  const SplitVariance before = split_variance(records);
  records[3].light[1] = std::numeric_limits<float>::infinity();
  records[4].apart[0] = std::numeric_limits<float>::quiet_NaN();
  CHECK(split_variance(records).bounces == doctest::Approx(before.bounces).epsilon(0.05));
  CHECK(split_variance(std::vector<SplitRecord>(1000)).bounces == 0);
  CHECK(split_variance(made_up(10, 0.01, 0.03)).bounces == 0);
  CHECK(split_variance({}).bounces == 0);
}

TEST_CASE("lights are drawn by the tree where that is no noisier") {
  const auto cells = made_up(4000, 0.02, 0.03);  // a path that is not split: 0.05
  const auto tree = [](double variance) {
    auto records = made_up(4000, variance, 0);
    for (SplitRecord& r : records) r.apart[0] = r.apart[1] = 0;
    return records;
  };
  CHECK(tree_pays(cells, tree(0.045)));
  CHECK(!tree_pays(cells, tree(0.055)));
  auto broken = cells;
  broken[7].light[0] = std::numeric_limits<float>::infinity();
  CHECK(tree_pays(broken, tree(0.045)));
  CHECK(!tree_pays(made_up(2000, 0.02, 0.03), std::vector<SplitRecord>(2000, {{1, 1}, {0, 0}})));  // too few to tell
  CHECK(!tree_pays(cells, std::vector<SplitRecord>(4000)));                          // nothing met, no variance
  CHECK(!tree_pays(cells, std::vector<SplitRecord>(4000, {{0.4f, 0.4f}, {0, 0}})));  // not half the light
  CHECK(!tree_pays(cells, {}));
}

TEST_CASE("one light sample does where several bring little") {
  const auto of = [](double variance) {
    auto records = made_up(4000, variance, 0);
    for (SplitRecord& r : records) r.apart[0] = r.apart[1] = 0;
    return records;
  };
  CHECK(one_light_sample_pays(of(0.03), of(0.04)));
  CHECK(!one_light_sample_pays(of(0.03), of(0.044)));
  CHECK(!one_light_sample_pays(of(0.03), {}));
}

TEST_CASE("more paths go on where bounces differ and are cheap, one where they don't or are dear") {
  const SplitCosts cheap{4, 1, 0}, usual{4, 3, 2}, dear{1, 40, 40};
  CHECK(best_bounce_samples({0.01, 0}, usual) == 1);
  CHECK(best_bounce_samples({1, 0.01}, usual) == 1);
  CHECK(best_bounce_samples({0.01, 1}, usual) == kMostBounceSamples);
  CHECK(best_bounce_samples({1, 1}, dear) == 1);
  CHECK(best_bounce_samples({0, 1}, usual) == kMostBounceSamples);
  CHECK(best_bounce_samples({1, 1}, cheap) > best_bounce_samples({1, 1}, usual));
  // The least of (v0 + vb / k) (c0 + k cb): c0 = 2.4 + 0.7 * 4 = 5.2, cb = 0.5 * 3 + 1.2 * 2 = 3.9, so k = sqrt(4 * 4 /
  // 3).
  CHECK(best_bounce_samples({0.25, 1}, usual) == 2);
  CHECK(best_bounce_samples({0.1, 1}, usual) == 4);
}

TEST_CASE("of the variance of bounces, what path reuse would leave alone is told") {
  auto records = made_up(40000, 0.01, 0.03);
  CHECK(split_variance(records).kept == 0);
  for (SplitRecord& r : records)
    for (int which = 0; which < 2; ++which) r.kept[which] = 0.25f * r.apart[which];
  const SplitVariance v = split_variance(records);
  CHECK(v.kept == doctest::Approx(0.25 * v.bounces).epsilon(1e-3));
  records[5].kept[0] = std::numeric_limits<float>::infinity();
  CHECK(split_variance(records).kept == doctest::Approx(v.kept).epsilon(0.05));
}

TEST_CASE("pixels share where bounces differ in what can be shared") {
  const SplitCosts usual{4, 3, 2};
  CHECK(!best_paths({0.01, 0}, usual, 8, false).reuse);       // no bounces
  CHECK(!best_paths({1, 0.1}, usual, 8, false).reuse);        // it is surfaces that differ
  CHECK(!best_paths({0.1, 1, 0.95}, usual, 8, false).reuse);  // what differs can't be shared
  CHECK(best_paths({0.1, 1}, usual, 8, false).reuse);
  CHECK(best_paths({0.1, 1, 0.2}, usual, 8, false).reuse);
  // (v0 + 0.3 vb / k) (c0 + k (cb + 2)): k = sqrt(0.3 * 5.2 / (0.1 * 5.9)) = 1.6 of 2 and 1.
  CHECK(best_paths({0.1, 1}, usual, 8, false).bounce_samples == 2);
  CHECK(best_paths({0.001, 1}, usual, 8, false).bounce_samples == kMostBounceSamples);
  CHECK(best_paths({0.001, 1}, usual, 3, false).bounce_samples == 3);
  // Paths alone are as many as there would be without it, whatever waves hold with it.
  CHECK(best_paths({0.1, 1, 0.95}, usual, 1, false).bounce_samples == best_bounce_samples({0.1, 1, 0.95}, usual));
  CHECK(best_paths({1, 0.1}, usual, 8, true).reuse);
  CHECK(best_paths({1, 0}, usual, 8, true).reuse);
  CHECK(best_paths({1, 0}, usual, 8, true).bounce_samples == 1);
}

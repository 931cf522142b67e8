// SPDX-License-Identifier: Apache-2.0
// Sampling of closures: densities integrate to what is sampled, samples carry them and are distributed as they say.
#include <doctest/doctest.h>

#include "closure_cases.h"

using namespace hw;
using namespace hw::closure_test;

TEST_CASE("densities integrate to the share of samples that succeed") {
  for (const Case& c : cases()) {
    for (float cos_o : {0.95f, 0.5f, 0.15f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      double integral = 0.0, sampled = 0.0;
      over_sphere(600, [&](vec3 w, double d) { integral += closures_eval(list, g, w).pdf * d; });
      stratified(32, 2u, [&](vec3 u) { sampled += closures_sample(list, g, u).label != HW_LABEL_NONE; });
      sampled /= 32.0 * 32.0 * 32.0;
      CHECK(integral == doctest::Approx(sampled).epsilon(0.01));
    }
  }
}

TEST_CASE("samples carry the value and density that evaluation gives") {
  for (const Case& c : cases()) {
    for (float cos_o : {0.9f, 0.4f, 0.1f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      stratified(8, 3u, [&](vec3 u) {
        const BsdfSample s = closures_sample(list, g, u);
        if (s.label == HW_LABEL_NONE || (s.label & HW_LABEL_SINGULAR) != 0u) return;
        const BsdfValue v = closures_eval(list, g, s.wi);
        CHECK(s.value.pdf == doctest::Approx(v.pdf).epsilon(5e-3));
        CHECK(bsdf_value_total(s.value).y == doctest::Approx(bsdf_value_total(v).y).epsilon(5e-3));
        CHECK(length(s.wi) == doctest::Approx(1.0).epsilon(1e-5));
        CHECK((dot(s.wi, kN) < 0.0f) == ((s.label & HW_LABEL_TRANSMIT) != 0u));
      });
    }
  }
}

TEST_CASE("samples fall as often as their density says") {
  // Cells of equal solid angle about an axis of their own, so that no edge of a lobe runs along them. Expected counts
  // by the midpoint rule within the cells; chi-square, the significance shared among all tests (Sidak).
  constexpr int kRows = 12, kColumns = 24, kSub = 24, kSamples = 40000;
  const vec3 axis = normalize(vec3(0.3f, -0.5f, 0.7f));
  vec3 x, y;
  warp_frame(axis, x, y);
  const double tests = cases().size() * 2.0, significance = 1.0 - std::pow(0.99, 1.0 / tests);
  for (const Case& c : cases()) {
    for (float cos_o : {0.8f, 0.25f}) {
      CAPTURE(std::string(c.name));
      CAPTURE(cos_o);
      const ShadingGeometry g = geometry(cos_o);
      const ClosureList list = build(c.build, g);
      std::vector<double> expected(kRows * kColumns + 1, 0.0), found(expected.size(), 0.0);
      double inside = 0.0;
      for (int i = 0; i < kRows * kSub; ++i) {
        for (int j = 0; j < kColumns * kSub; ++j) {
          const float z = 1.0f - 2.0f * (i + 0.5f) / (kRows * kSub),
                      phi = 2.0f * HW_PI * (j + 0.5f) / (kColumns * kSub);
          const float s = std::sqrt(1.0f - z * z);
          const vec3 w = s * std::cos(phi) * x + s * std::sin(phi) * y + z * axis;
          const double p = closures_eval(list, g, w).pdf * 4.0 * HW_PI / (double(kRows) * kColumns * kSub * kSub);
          expected[(i / kSub) * kColumns + j / kSub] += p * kSamples;
          inside += p;
        }
      }
      expected.back() = std::max(1.0 - inside, 0.0) * kSamples;  // no direction
      std::mt19937 random(11);
      std::uniform_real_distribution<float> u(0.0f, 1.0f);
      for (int i = 0; i < kSamples; ++i) {
        const BsdfSample s = closures_sample(list, g, min(vec3(u(random), u(random), u(random)), vec3(0.99999994f)));
        size_t cell = expected.size() - 1;
        if (s.label != HW_LABEL_NONE) {
          const float turn = std::atan2(dot(s.wi, y), dot(s.wi, x)) / (2.0f * HW_PI);
          const int row = std::clamp(int((1.0f - dot(s.wi, axis)) * 0.5f * kRows), 0, kRows - 1);
          cell = row * kColumns + std::min(int((turn < 0.0f ? turn + 1.0f : turn) * kColumns), kColumns - 1);
        }
        found[cell] += 1.0;
      }
      double chi2 = 0.0, pooled_expected = 0.0, pooled_found = 0.0;
      int freedom = -1;
      auto count = [&](double e, double f) {
        chi2 += (f - e) * (f - e) / e;
        ++freedom;
      };
      for (size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] >= 8.0) {
          count(expected[i], found[i]);
        } else {
          pooled_expected += expected[i];
          pooled_found += found[i];
        }
      }
      if (pooled_expected > 8.0) count(pooled_expected, pooled_found);
      // Wilson and Hilferty: the cube root of chi2 / freedom is nearly normal.
      const double z = (std::cbrt(chi2 / freedom) - (1.0 - 2.0 / (9.0 * freedom))) / std::sqrt(2.0 / (9.0 * freedom));
      const double p_value = 0.5 * std::erfc(z / std::sqrt(2.0));
      CAPTURE(chi2);
      CAPTURE(freedom);
      CHECK(p_value > significance);
    }
  }
}

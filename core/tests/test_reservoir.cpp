// SPDX-License-Identifier: Apache-2.0
// Reservoirs: what a stream keeps and weighs, MIS weights of merging (on a discrete toy problem, whose integral is a
// sum), and updates that do not depend on their order.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "lib/reservoir.h"
#include "lib/reservoir_race.h"

using namespace hw;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Multiples of 2^-24 in [0, 1), as the sampler gives them.
struct Random {
  std::mt19937 engine;
  explicit Random(uint seed) : engine(seed) {}
  float operator()() { return sampler_to_float(uint(engine())); }
};

// Chi-square of counts against probabilities, as deviations from its mean.
double chi_square_z(const std::vector<int>& counts, const std::vector<double>& p) {
  const double n = std::accumulate(counts.begin(), counts.end(), 0.0);
  double chi = 0;
  int cells = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (p[i] == 0) {
      REQUIRE(counts[i] == 0);
      continue;
    }
    chi += (counts[i] - n * p[i]) * (counts[i] - n * p[i]) / (n * p[i]);
    ++cells;
  }
  return (chi - (cells - 1)) / std::sqrt(2.0 * (cells - 1));
}

struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, ++n; }
  double value() const { return sum / n; }
  double z(double expected) const {
    return (value() - expected) / std::sqrt((squares / n - value() * value()) / n + 1e-300);
  }
};

// A world of twelve light samples. Surfaces see them through their targets; surface 0 is the one shaded: the others are
// blind to some of what it sees. What is wanted is the sum of `integrand`, which is not proportional to the target.
constexpr int kLights = 12, kSurfaces = 4;
constexpr float kTarget[kSurfaces][kLights] = {{1, 2, 0.5f, 4, 0.1f, 3, 1, 0, 2, 1, 0.7f, 0.2f},
                                               {1, 1, 1, 0, 0, 0, 0, 2, 2, 2, 0.1f, 0},
                                               {0, 0, 3, 5, 0.2f, 2, 0, 0, 0, 4, 1, 1},
                                               {9, 0, 0, 0, 0, 0.1f, 0, 6, 0.5f, 0, 0, 0}};
constexpr float kIntegrand[kLights] = {2, 1, 1, 3, 0.4f, 0, 1, 0, 5, 0.5f, 0.7f, 0.3f};
constexpr int kCandidates[kSurfaces] = {1, 4, 3, 8};  // confidences too

// The reservoir that a surface makes of candidates drawn uniformly.
Reservoir initial(int surface, Random& random) {
  ReservoirStream s = stream_begin();
  const float m = 1.0f / float(kCandidates[surface]);
  for (int i = 0; i < kCandidates[surface]; ++i) {
    const uint x = std::min(uint(random() * kLights), uint(kLights - 1));
    const float target = kTarget[surface][x];
    stream_add(s, x, 0, 0, m * target * float(kLights), target, 1, random());
  }
  return stream_end_mis(s);
}

enum class Merge { kBalance, kPairwise, kCount, kSupport };

Reservoir merge(const std::array<Reservoir, kSurfaces>& from, Merge how, Random& random) {
  float c_all = 0;
  for (const Reservoir& r : from) c_all += r.confidence;
  ReservoirStream s = stream_begin();
  for (int i = 0; i < kSurfaces; ++i) {
    const Reservoir& r = from[i];
    const float target = r.light == HW_NONE ? 0 : kTarget[0][r.light];
    float m = r.confidence;
    if (r.light != HW_NONE && how == Merge::kBalance) {
      float others = 0;
      for (int j = 0; j < kSurfaces; ++j) others += j == i ? 0 : from[j].confidence * kTarget[j][r.light];
      m = mis_balance(r.confidence, kTarget[i][r.light], others);
    } else if (r.light != HW_NONE && how == Merge::kPairwise && i > 0) {
      m = mis_pairwise(r.confidence, from[0].confidence, c_all, kTarget[i][r.light], target);
    } else if (r.light != HW_NONE && how == Merge::kPairwise) {
      m = mis_pairwise_base(r.confidence, c_all);
      for (int j = 1; j < kSurfaces; ++j)
        m += mis_pairwise_canonical(from[j].confidence, r.confidence, c_all, kTarget[j][r.light], target);
    }
    stream_add(s, r.light, r.u, r.v, m * stream_weight(r, target), target, r.confidence, random());
  }
  if (how == Merge::kCount) return stream_end_count(s);
  if (how != Merge::kSupport) return stream_end_mis(s);
  float support = 0;
  for (int i = 0; i < kSurfaces; ++i) support += s.light != HW_NONE && kTarget[i][s.light] > 0 ? from[i].confidence : 0;
  return stream_end_support(s, support);
}

Mean merged_mean(Merge how, int rounds) {
  Random random(7);
  Mean mean;
  for (int n = 0; n < rounds; ++n) {
    std::array<Reservoir, kSurfaces> from;
    for (int i = 0; i < kSurfaces; ++i) from[i] = initial(i, random);
    const Reservoir r = merge(from, how, random);
    CHECK(r.confidence == 16);
    mean.add(r.light == HW_NONE ? 0 : r.weight * kIntegrand[r.light]);
  }
  return mean;
}

}  // namespace

TEST_CASE("a stream keeps each candidate as often as its share of the weights") {
  const std::vector<float> w{0, 1, 3, 0.5f, 7, 0.01f, 2};
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  std::vector<double> p;
  for (float x : w) p.push_back(x / sum);
  std::vector<int> counts(w.size(), 0);
  Random random(1);
  for (int n = 0; n < 200000; ++n) {
    ReservoirStream s = stream_begin();
    uint last = HW_NONE;
    for (uint i = 0; i < w.size(); ++i)
      if (stream_add(s, i, float(i), -float(i), w[i], 2.0f, 1.5f, random())) last = i;
    REQUIRE(last == s.light);
    REQUIRE(s.u == float(s.light));
    REQUIRE(s.v == -float(s.light));
    ++counts[s.light];
    REQUIRE(s.sum == doctest::Approx(sum));
    REQUIRE(s.confidence == doctest::Approx(1.5 * double(w.size())));
    REQUIRE(stream_end_mis(s).weight == doctest::Approx(sum / 2));
    REQUIRE(stream_end_count(s).weight == doctest::Approx(sum / 2 / s.confidence));
    REQUIRE(stream_end_support(s, 4).weight == doctest::Approx(sum / 8));
  }
  CHECK(std::abs(chi_square_z(counts, p)) < 4);
}

TEST_CASE("what is no weight adds its confidence alone; sums stay finite") {
  ReservoirStream s = stream_begin();
  for (float bad : {0.0f, -1.0f, kInf, -kInf, kNan, 1e-40f}) {
    CHECK_FALSE(stream_add(s, 1, 0, 0, bad, 1, 1, 0));
    CHECK_FALSE(stream_add(s, 1, 0, 0, 1, bad, 1, 0));
    CHECK_FALSE(stream_add(s, HW_NONE, 0, 0, 1, 1, bad, 0));
  }
  CHECK(s.light == HW_NONE);
  CHECK(s.sum == 0);
  CHECK(s.confidence == 12);
  const Reservoir none = stream_end_count(s);
  CHECK(none.light == HW_NONE);
  CHECK(none.weight == 0);
  CHECK(none.confidence == 12);
  CHECK(stream_weight(none, 5) == 0);
  for (uint i = 0; i < 8; ++i) stream_add(s, i, 0, 0, 3e38f, 1, 3e38f, 0.99999994f);
  CHECK(s.light == 0);  // the first is always taken, whatever u
  CHECK(std::isfinite(s.sum));
  CHECK(std::isfinite(s.confidence));
  CHECK(std::isfinite(stream_end_mis(s).weight));
  CHECK(stream_end_support(s, 0).light == HW_NONE);
  CHECK(reservoir_capped(stream_end_mis(s), 20).confidence == 20);
  s.target = 1e-37f;  // W would be infinite
  CHECK(stream_end_mis(s).light == HW_NONE);
}

TEST_CASE("merging is unbiased with balance, pairwise and 1/Z weights; 1/M loses what neighbours cannot see") {
  double truth = 0, one_over_m = 0;
  for (int x = 0; x < kLights; ++x) {
    truth += kIntegrand[x];
    for (int i = 0; i < kSurfaces; ++i) one_over_m += kTarget[i][x] > 0 ? kIntegrand[x] * kCandidates[i] / 16.0 : 0;
  }
  REQUIRE(one_over_m < 0.6 * truth);
  const int rounds = 400000;
  const Mean balance = merged_mean(Merge::kBalance, rounds), pairwise = merged_mean(Merge::kPairwise, rounds),
             support = merged_mean(Merge::kSupport, rounds), count = merged_mean(Merge::kCount, rounds);
  CHECK(std::abs(balance.z(truth)) < 4);
  CHECK(std::abs(pairwise.z(truth)) < 4);
  CHECK(std::abs(support.z(truth)) < 4);
  CHECK(std::abs(count.z(one_over_m)) < 4);
  CHECK(std::abs(balance.value() / truth - 1) < 0.01);  // the Z above are sharp
  CHECK(std::abs(pairwise.value() / truth - 1) < 0.01);
}

TEST_CASE("MIS weights sum to one where the canonical target is positive, whatever the others") {
  Random random(3);
  const float extremes[] = {0, 0, 1e-30f, 1, 1e20f, 1e38f};
  for (int n = 0; n < 20000; ++n) {
    const int k = 1 + n % 6;
    std::vector<float> c(k), p(k);
    float c_all = 0;
    for (int i = 0; i < k; ++i) {
      c[i] = i == 0 ? 1.0f : std::floor(random() * 20);
      p[i] = n % 3 == 0 ? extremes[int(random() * 6)] : random() < 0.3f ? 0 : random() * 10;
      c_all += c[i];
    }
    if (!(p[0] > 0)) p[0] = 1e-3f;
    double pairwise = mis_pairwise_base(c[0], c_all);
    for (int i = 1; i < k; ++i) {
      const float own = mis_pairwise(c[i], c[0], c_all, p[i], p[0]);
      REQUIRE(own >= 0);
      if (p[i] == 0) REQUIRE(own == 0);
      pairwise += own + mis_pairwise_canonical(c[i], c[0], c_all, p[i], p[0]);
      if (c_all * std::max(p[i], p[0]) > 1e38f) continue;  // saturates
      // The formula as it is printed, in double.
      const double bar = double(c_all) - c[0], a = bar * p[i], b = double(c[0]) * p[0];
      REQUIRE(own == doctest::Approx(c[i] / double(c_all) * a / (a + b)).epsilon(1e-4));
    }
    REQUIRE(pairwise == doctest::Approx(1).epsilon(1e-5));
    if (n % 3 == 0) continue;  // sums of products overflow
    double balance = 0;
    for (int i = 0; i < k; ++i) {
      float others = 0;
      for (int j = 0; j < k; ++j) others += j == i ? 0 : c[j] * p[j];
      balance += mis_balance(c[i], p[i], others);
    }
    REQUIRE(balance == doctest::Approx(1).epsilon(1e-5));
  }
  // Zeros and nonsense give numbers.
  CHECK(mis_pairwise_base(0, 0) == 1);
  CHECK(mis_pairwise(0, 0, 0, 1, 1) == 0);
  CHECK(mis_pairwise_canonical(0, 0, 0, 1, 1) == 0);
  CHECK(mis_pairwise(1, 1, 2, 0, 0) == 0);
  CHECK(mis_balance(1, 0, 0) == 0);
  CHECK(mis_balance(1, kNan, 1) == 0);
  CHECK(mis_balance(1, kInf, kInf) == 0.5f);
  CHECK(mis_balance(1, 1, -1) == 1);
}

TEST_CASE("a race is won by each as often as its share of the weights, in any order") {
  const std::vector<float> w{3, 0, 1, 0.25f, -2, 6, kInf, 0.01f, 2, kNan};
  std::vector<double> p;
  double sum = 0;
  for (float x : w) p.push_back(std::isfinite(x) && x > 0 ? x : 0), sum += p.back();
  for (double& x : p) x /= sum;
  std::vector<int> counts(w.size(), 0);
  Random random(5);
  for (int n = 0; n < 200000; ++n) {
    std::vector<uint64_t> keys, doubled;
    for (uint i = 0; i < w.size(); ++i) {
      const float u = random();
      keys.push_back(race_key(w[i], u, 1000 * i));
      doubled.push_back(race_key(2 * w[i], u, 1000 * i));
    }
    const uint64_t best = *std::min_element(keys.begin(), keys.end());
    REQUIRE(race_id(*std::min_element(doubled.begin(), doubled.end())) == race_id(best));
    ++counts[race_id(best) / 1000];
    std::shuffle(keys.begin(), keys.end(), random.engine);
    uint64_t shuffled = race_none();
    for (uint64_t k : keys) shuffled = std::min(shuffled, k);
    REQUIRE(shuffled == best);
  }
  CHECK(std::abs(chi_square_z(counts, p)) < 4);
}

TEST_CASE("a race among millions is fair: a u of zero does not beat a greater weight") {
  // Eight million candidates of weight 1 and as many of weight 3. Of each only the least u matter, and those are drawn
  // by their spacings, then cut to the sampler's 24 bits: most races have a u of 0 among the light ones.
  const int races = 4000;
  Random random(11);
  int heavy = 0;
  for (int race = 0; race < races; ++race) {
    uint64_t best = race_none();
    for (uint weight : {1u, 3u}) {
      double at = 0;
      for (uint i = 0; i < 24; ++i) {
        at -= std::log((double(random.engine()) + 0.5) / 4294967296.0) / 8e6;
        const float u = float(std::floor(at * 16777216.0) / 16777216.0);
        best = std::min(best, race_key(float(weight), u, uint(race) * 64 + i * 2 + weight / 2));
      }
    }
    heavy += race_id(best) & 1;
  }
  CHECK(std::abs(heavy - 0.75 * races) / std::sqrt(races * 0.75 * 0.25) < 4);
}

TEST_CASE("race keys are ordered and bounded") {
  CHECK(race_key(0, 0.5f, 3) == race_none());
  CHECK(race_key(kNan, 0.5f, 3) == race_none());
  for (float w : {1.2e-38f, 1e-20f, 1.0f, 1e20f, 3e38f}) {
    for (float u : {-1.0f, 0.0f, 0.5f, 0.99999994f, 1.0f, 2.0f, kNan}) {
      CHECK(race_key(w, u, 3) < race_none());
      CHECK((race_key(w, u, 3) >> 63) == 0);
      CHECK(race_id(race_key(w, u, 3)) == 3);
    }
  }
  double worst = 0;
  for (float t = 5.9604644775390625e-8f; t < 1; t = t * 1.001f + 1e-9f)
    worst = std::max(worst, std::abs(race_exponential(t) / -std::log1p(-double(t)) - 1));
  CHECK(worst < 2e-6);
}

TEST_CASE("fixed-point sums are exact, scale with the emission and saturate") {
  Random random(9);
  for (int exponent : {-60, -3, 0, 7, 80}) {
    const float unit = std::ldexp(1.0f, exponent - HW_FIXED_FRACTION);
    uint64_t sum = 0, doubled = 0;
    double exact = 0;
    std::vector<float> terms;
    for (int i = 0; i < 5000; ++i) {
      terms.push_back(std::ldexp(random(), exponent + int(random() * 24) - 12));
      const uint64_t fixed = fixed_from_float(terms.back(), exponent);
      REQUIRE(std::abs(double(fixed) - double(terms.back()) / unit) <= 0.5);
      sum += fixed;
      doubled += fixed_from_float(2 * terms.back(), exponent + 1);
      exact += double(terms.back());
    }
    CHECK(sum == doubled);
    CHECK(fixed_to_float(sum, exponent) == doctest::Approx(exact).epsilon(1e-6));
    CHECK(fixed_to_float(sum, exponent + 1) == 2 * fixed_to_float(sum, exponent));
    std::reverse(terms.begin(), terms.end());
    uint64_t backwards = 0;
    for (float t : terms) backwards += fixed_from_float(t, exponent);
    CHECK(backwards == sum);
    CHECK(fixed_from_float(0.49f * unit, exponent) == 0);
    CHECK(fixed_from_float(0.51f * unit, exponent) == 1);
    CHECK(fixed_from_float(unit, exponent) == 1);
    CHECK(fixed_to_float(1, exponent) == unit);
  }
  const uint64_t most = fixed_from_float(3e38f, 0);
  CHECK(most == (uint64_t(1) << HW_FIXED_TERM_BITS) - 1);
  CHECK(fixed_from_float(1048575.9375f, 0) == most - (1u << 16) + 1);  // the largest float below 2^20
  CHECK(fixed_from_float(1048576.0f, 0) == most);
  CHECK(((most << 24) >> 24) == most);  // 2^24 of them fit
  CHECK(fixed_to_float(~uint64_t(0), 0) == doctest::Approx(std::ldexp(1.0, 44)));
  CHECK(fixed_to_float(~uint64_t(0), 300) == HW_INFINITY);
  for (float bad : {0.0f, -1.0f, kNan, kInf, -kInf, 1e-40f}) CHECK(fixed_from_float(bad, 0) == 0);
  for (int exponent : {std::numeric_limits<int>::min(), -300, 300, std::numeric_limits<int>::max()}) {
    CHECK(fixed_from_float(1, exponent) == (exponent < 0 ? most : 0));
    CHECK(std::isfinite(fixed_to_float(1, exponent)));
  }
  CHECK(fixed_exponent(1) == 0);
  CHECK(fixed_exponent(0.75f) == -1);
  CHECK(fixed_exponent(1023) == 9);
  CHECK(fixed_exponent(0) == 0);
  CHECK(fixed_exponent(kNan) == 0);
}

// SPDX-License-Identifier: Apache-2.0
// The sampler's points are Owen-scrambled nets: stratified in a pixel, uniform and independent across pixels,
// dimensions and seeds. The pixel filters follow their densities.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "lib/filter.h"
#include "lib/sampler.h"

using namespace hw;

namespace {

// Points of every elementary interval of the first 2^m points, in the two dimensions that `get` gives: 1 each in a net.
int net_errors(int m, const std::function<vec2(uint)>& get) {
  int errors = 0;
  const uint n = 1u << m;
  for (int k = 0; k <= m; ++k) {
    std::vector<int> count(n, 0);
    for (uint i = 0; i < n; ++i) {
      const vec2 p = get(i);
      const uint x = uint(p.x * float(1u << k)), y = uint(p.y * float(1u << (m - k)));
      ++count[(x << (m - k)) + y];
    }
    for (int c : count) errors += c != 1;
  }
  return errors;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
  const double n = double(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) ma += a[i] / n, mb += b[i] / n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace

TEST_CASE("Sobol's first two dimensions are the known ones, the others too") {
  // By the direction numbers of Joe and Kuo (new-joe-kuo-6.21201), Gray code left out.
  const uint y[] = {0u,          0x80000000u, 0xc0000000u, 0x40000000u, 0xa0000000u,
                    0x20000000u, 0x60000000u, 0xe0000000u, 0xf0000000u};
  const uint z[] = {0u,          0x80000000u, 0xc0000000u, 0x40000000u, 0x60000000u,
                    0xe0000000u, 0xa0000000u, 0x20000000u, 0x90000000u};
  const uint w[] = {0u,          0x80000000u, 0xc0000000u, 0x40000000u, 0x20000000u,
                    0xa0000000u, 0xe0000000u, 0x60000000u, 0x50000000u};
  for (uint i = 0; i < 9; ++i) {
    CAPTURE(i);
    CHECK(sampler_sobol_y(i) == y[i]);
    CHECK(sampler_sobol_z(i) == z[i]);
    CHECK(sampler_sobol_w(i) == w[i]);
  }
}

TEST_CASE("pairs of dimensions are (0, m, 2)-nets at every power of two") {
  for (uint pixel = 0; pixel < 8; ++pixel) {
    const uint h = sampler_pixel_hash(pixel * 13, pixel * 7);
    for (int m = 1; m <= 10; ++m) {
      CHECK(net_errors(m, [&](uint i) { return sampler_2d(h, i, 3, pixel); }) == 0);
      CHECK(net_errors(m, [&](uint i) { return sampler_2d(h, i + (5u << m), 3, pixel); }) == 0);  // later blocks too
      CHECK(net_errors(m, [&](uint i) {
              const vec4 p = sampler_4d(h, i, 9, pixel);
              return vec2(p.x, p.y);
            }) == 0);
    }
    // Every single dimension of a group is stratified.
    std::vector<std::vector<int>> count(5, std::vector<int>(1024, 0));
    for (uint i = 0; i < 1024; ++i) {
      const vec4 p = sampler_4d(h, i, 2, pixel);
      for (int d = 0; d < 4; ++d) ++count[d][int(p[d] * 1024)];
      ++count[4][int(sampler_1d(h, i, 6, pixel) * 1024)];
    }
    for (const auto& c : count) CHECK(std::all_of(c.begin(), c.end(), [](int k) { return k == 1; }));
  }
}

TEST_CASE("scrambling is uniform over pixels, for any sample") {
  for (const uint sample : {0u, 1u, 7u, 100u}) {
    for (int d = 0; d < 4; ++d) {
      std::vector<double> count(64, 0);
      constexpr uint kSide = 128;
      for (uint y = 0; y < kSide; ++y) {
        for (uint x = 0; x < kSide; ++x) count[int(sampler_4d(sampler_pixel_hash(x, y), sample, 5, 0)[d] * 64)] += 1;
      }
      double chi2 = 0;
      const double expected = kSide * kSide / 64.0;
      for (double c : count) chi2 += (c - expected) * (c - expected) / expected;
      CAPTURE(sample);
      CAPTURE(d);
      CHECK(chi2 < 130);  // 63 degrees of freedom: mean 63, standard deviation 11
    }
  }
}

TEST_CASE("dimensions, neighbours, samples and seeds are not correlated") {
  constexpr uint kSide = 128;
  using Get = std::function<double(uint, uint)>;
  const std::vector<Get> series{
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y), 0, 4, 0).x; },
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y), 0, 4, 0).y; },
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y), 0, 5, 0).x; },  // next dimension
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y), 0, 5, 0).y; },
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x + 1, y), 0, 4, 0).x; },  // neighbours
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y + 1), 0, 4, 0).x; },
      [](uint x, uint y) { return sampler_2d(sampler_pixel_hash(x, y), 0, 4, 1).x; },  // next seed
      [](uint x, uint y) { return sampler_1d(sampler_pixel_hash(x, y), 0, 12, 0); },
      [](uint x, uint y) { return sampler_3d(sampler_pixel_hash(x, y), 0, 6, 0).z; },
      [](uint x, uint y) { return sampler_4d(sampler_pixel_hash(x, y), 0, 7, 0).w; },
  };
  std::vector<std::vector<double>> values(series.size());
  for (std::size_t s = 0; s < series.size(); ++s) {
    for (uint y = 0; y < kSide; ++y) {
      for (uint x = 0; x < kSide; ++x) values[s].push_back(series[s](x, y));
    }
  }
  for (std::size_t a = 0; a < series.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      CAPTURE(a);
      CAPTURE(b);
      CHECK(std::abs(correlation(values[a], values[b])) < 5.0 / kSide);
    }
  }
  // Within one pixel, over samples: padding must not tie groups together. 64 pixels, 256 samples each.
  double worst = 0, mean = 0;
  for (uint p = 0; p < 64; ++p) {
    std::vector<double> a, b;
    for (uint i = 0; i < 256; ++i) {
      a.push_back(sampler_2d(sampler_pixel_hash(p, 3), i, 1, 0).x);
      b.push_back(sampler_2d(sampler_pixel_hash(p, 3), i, 2, 0).x);
    }
    const double c = correlation(a, b);
    worst = std::max(worst, std::abs(c));
    mean += c / 64;
  }
  CHECK(worst < 0.35);
  CHECK(std::abs(mean) < 0.05);
}

TEST_CASE("padded groups integrate a product without bias") {
  // Mean over pixels of an integral across two groups equals the true value within its error.
  double sum = 0, squares = 0;
  constexpr int kPixels = 4096;
  for (uint p = 0; p < kPixels; ++p) {
    double v = 0;
    for (uint i = 0; i < 16; ++i) {
      const vec2 a = sampler_2d(sampler_pixel_hash(p, 9), i, 1, 0);
      const vec3 b = sampler_3d(sampler_pixel_hash(p, 9), i, 2, 0);
      v += a.x * b.y * std::exp(a.y * b.z) / 16;
    }
    sum += v / kPixels;
    squares += v * v / kPixels;
  }
  // 1/4 times the integral of exp(xy) over the unit square, 1.3179021514544038.
  CHECK(std::abs(sum - 0.32947553786) < 5 * std::sqrt((squares - sum * sum) / kPixels));
}

TEST_CASE("the same arguments give the same bits") {
  // Values that any device must reproduce: integer arithmetic and one exact conversion.
  const vec4 p = sampler_4d(sampler_pixel_hash(12, 34), 56, sampler_dimension(2, HW_DIM_BSDF), 78);
  CHECK(p == vec4(0.445174634f, 0.0960877538f, 0.218340158f, 0.615810335f));
  CHECK(sampler_blue_2d(12, 34, 5, 3, 6, 7) == vec2(0.524197042f, 0.0294244289f));
  CHECK(sampler_1d(1, 2, 3, 4) == 0.0435503721f);
  CHECK(p.x != sampler_4d(sampler_pixel_hash(12, 34), 56, sampler_dimension(2, HW_DIM_BSDF), 79).x);
  CHECK(sampler_to_float(0xffffffffu) < 1.0f);
  std::set<uint> dimensions;
  for (uint bounce = 0; bounce < 32; ++bounce) {
    for (uint d = 0; d < HW_DIM_BOUNCE_STRIDE; ++d) dimensions.insert(sampler_dimension(bounce, d));
  }
  CHECK(dimensions.size() == 32 * HW_DIM_BOUNCE_STRIDE);
  CHECK(*dimensions.begin() > HW_DIM_TIME);
}

TEST_CASE("blue noise: neighbouring pixels' errors cancel, and each pixel is still stratified") {
  constexpr uint kSide = 128;
  for (const uint log2_samples : {0u, 2u}) {
    // Mean square error after averaging blocks of 4 x 4 pixels, of a smooth integrand.
    const auto error = [&](bool blue) {
      double mse = 0;
      for (uint by = 0; by < kSide; by += 4) {
        for (uint bx = 0; bx < kSide; bx += 4) {
          double v = 0;
          for (uint k = 0; k < 16; ++k) {
            const uint x = bx + k % 4, y = by + k / 4;
            for (uint i = 0; i < 1u << log2_samples; ++i) {
              const vec2 p =
                  blue ? sampler_blue_2d(x, y, i, log2_samples, 3, 1) : sampler_2d(sampler_pixel_hash(x, y), i, 3, 1);
              v += std::exp(-p.x - 2 * p.y) / double(16u << log2_samples);
            }
          }
          const double truth = (1 - std::exp(-1.0)) * (1 - std::exp(-2.0)) / 2;
          mse += (v - truth) * (v - truth);
        }
      }
      return mse;
    };
    CHECK(error(true) < 0.25 * error(false));
  }
  for (uint p = 0; p < 8; ++p) {
    CHECK(net_errors(6, [&](uint i) { return sampler_blue_2d(p, 3 * p, i, 6, 2, 0); }) == 0);
    CHECK(net_errors(3, [&](uint i) { return sampler_blue_2d(p, 3 * p, i, 6, 2, 0); }) == 0);  // a prefix
  }
}

TEST_CASE("filters follow their density") {
  const auto blackman_harris = [](double x) {
    const double a = 3.14159265358979323846 * x;
    return 0.35875 + 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) + 0.01168 * std::cos(3 * a);
  };
  const auto gaussian = [](double x) { return std::exp(-8 * x * x); };
  struct Case {
    uint type;
    double half_width;
    std::function<double(double)> density;
  };
  for (const float width : {1.5f, 0.7f, 4.0f}) {
    for (const Case& c :
         {Case{HW_FILTER_BLACKMAN_HARRIS, 1, blackman_harris}, Case{HW_FILTER_GAUSSIAN, 1.5, gaussian}}) {
      // The integral of the density up to the drawn position must be u again.
      constexpr int kSteps = 20000;
      std::vector<double> integral(kSteps + 1, 0);
      const double step = 2 * c.half_width / kSteps;
      for (int i = 0; i < kSteps; ++i)
        integral[i + 1] = integral[i] + step * c.density(-c.half_width + (i + 0.5) * step);
      double worst = 0, worst_density = 0;
      for (int i = 0; i < 4096; ++i) {
        const float u = (float(i) + 0.5f) / 4096;
        const vec2 p = filter_sample(c.type, width, vec2(u, 1 - u));
        const double at = (double(p.x) / width + c.half_width) / step;
        REQUIRE(at >= 0);
        REQUIRE(at <= kSteps);
        const int k = std::min(int(at), kSteps - 1);
        const double v = (integral[k] + (at - k) * (integral[k + 1] - integral[k])) / integral[kSteps];
        worst = std::max(worst, std::abs(v - u));
        worst_density = std::max(worst_density, double(std::abs(p.x + p.y)));  // symmetric
      }
      CAPTURE(c.type);
      CHECK(worst < 1e-5);
      CHECK(worst_density < 1e-4 * width);
    }
    const vec2 box = filter_sample(HW_FILTER_BOX, width, vec2(0.25f, 1.0f - 5.9604644775390625e-8f));
    CHECK(box.x == -0.25f);
    CHECK(box.y <= 0.5f);
  }
}

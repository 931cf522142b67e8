// SPDX-License-Identifier: Apache-2.0
// Integrates the albedo tables (layout: shaders/lib/luts.h) over the visible normals of GGX. The library does not call
// it: it makes core/materials/albedo_tables.inc (tools/make_albedo_tables.cpp), and a test compares the two.
//
// With normals h drawn as they are visible from wo (Dupuy and Benyoub 2023), the albedo of a lobe is the mean of
// F(wo·h) G2 / G1 over those h whose direction leaves on the lobe's side. The azimuth runs over half a turn, since the
// other half mirrors it. The entries at roughness 0 and cosine 0 are taken at 1e-4, index z = 1 at 0.99, as Cycles
// does, so that interpolation gives its values.
#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include "materials/luts.h"

namespace hw {
namespace {

constexpr int kFine = 32;    // points per axis of E
constexpr int kCoarse = 16;  // points per axis of the other tables

struct Facet {
  double cos_oh;  // wo·h
  double h_z;
  double weight;
};

// Gauss-Legendre nodes and weights on [0, 1] by Newton's method on the Legendre polynomial.
std::vector<std::array<double, 2>> gauss_legendre(int n) {
  std::vector<std::array<double, 2>> nodes;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(M_PI * (i + 0.75) / (n + 0.5)), derivative = 1.0;
    for (int step = 0; step < 20; ++step) {
      double p0 = 1.0, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      derivative = n * (x * p1 - p0) / (x * x - 1.0);
      x -= p1 / derivative;
    }
    nodes.push_back({0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * derivative * derivative)});
  }
  return nodes;
}

double grid_value(int i, int n) { return std::max(double(i) / (n - 1), 1e-4); }

// One over-the-visible-normals quadrature for a roughness and a cosine.
class VisibleNormals {
 public:
  VisibleNormals(double roughness, double cos_o, int n)
      : alpha2_(roughness * roughness * roughness * roughness), cos_o_(cos_o), singular_(alpha2_ <= 2e-10) {
    if (singular_) {
      facets_.push_back({cos_o, 1.0, 1.0});
      return;
    }
    const double alpha = roughness * roughness;
    const double sin_o = std::sqrt(1.0 - cos_o * cos_o);
    double vx = alpha * sin_o, vz = cos_o;
    const double inv = 1.0 / std::sqrt(vx * vx + vz * vz);
    vx *= inv;
    vz *= inv;
    facets_.reserve(size_t(2) * n * n);
    // The steep facets lie at the low end of the cap, where the integrand falls to 0 over a share alpha^2 of it: graded
    // nodes there. The azimuth is periodic, so equal steps converge as fast as Gauss's.
    for (const auto& [t, weight] : gauss_legendre(2 * n)) {
      const double graded = t * t * t * t;
      const double z = graded * (1.0 + vz) - vz;
      const double r = std::sqrt(std::max(1.0 - z * z, 0.0));
      for (int i = 0; i < n; ++i) {
        const double phi = M_PI * (i + 0.5) / n;
        const double x = alpha * (r * std::cos(phi) + vx), y = alpha * r * std::sin(phi), up = graded * (1.0 + vz);
        const double scale = 1.0 / std::sqrt(x * x + y * y + up * up);
        facets_.push_back({(x * sin_o + up * cos_o) * scale, up * scale, weight * 4.0 * t * t * t / n});
      }
    }
  }

  // Smith's G2 / G1(wo) for a direction at this cosine.
  double shadowing(double cos_i) const {
    if (singular_) return 1.0;
    const double o = lambda(cos_o_), i = lambda(cos_i);
    return (1.0 + o) / (1.0 + o + i);
  }
  double reflected_z(const Facet& f) const { return 2.0 * f.cos_oh * f.h_z - cos_o_; }
  double cos_o() const { return cos_o_; }
  const std::vector<Facet>& facets() const { return facets_; }

 private:
  double lambda(double c) const { return 0.5 * (std::sqrt(1.0 + alpha2_ * std::max(1.0 / (c * c) - 1.0, 0.0)) - 1.0); }

  double alpha2_;
  double cos_o_;
  bool singular_;
  std::vector<Facet> facets_;
};

double fresnel(double cos_i, double eta, double& cos_t) {
  const double t2 = eta * eta - 1.0 + cos_i * cos_i;
  cos_t = 0.0;
  if (t2 <= 0.0) return 1.0;
  const double g = std::sqrt(t2);
  cos_t = g / eta;
  const double s = (cos_i - g) / (cos_i + g), p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return 0.5 * (s * s + p * p);
}

double reflection_albedo(const VisibleNormals& v) {
  double sum = 0.0;
  for (const Facet& f : v.facets()) {
    const double z = v.reflected_z(f);
    if (z > 0.0) sum += f.weight * v.shadowing(z);
  }
  return sum;
}

double glass_albedo(const VisibleNormals& v, double eta) {
  const bool straight = std::abs(eta - 1.0) < 1e-4;
  double sum = 0.0;
  for (const Facet& f : v.facets()) {
    double cos_t;
    const double F = fresnel(f.cos_oh, eta, cos_t);
    const double up = v.reflected_z(f);
    if (up > 0.0) sum += f.weight * F * v.shadowing(up);
    const double down = f.h_z * (f.cos_oh / eta - cos_t) - v.cos_o() / eta;
    if (F < 1.0 && down < 0.0) sum += f.weight * (1.0 - F) * (straight ? 1.0 : v.shadowing(down));
  }
  return sum;
}

template <typename Rise>
double mean_rise(const VisibleNormals& v, Rise rise) {
  double sum = 0.0;
  for (const Facet& f : v.facets()) {
    if (v.reflected_z(f) > 0.0) sum += f.weight * rise(f.cos_oh);
  }
  return sum;
}

// Index of refraction of table slice z: f0 = z^4. Rounded as in single precision, where the first slice is exactly 1.
double slice_ior(int k) {
  const float z = std::min(float(grid_value(k, kCoarse)), 0.99f);
  const float root = z * z;
  return double((1.0f + root) / (1.0f - root));
}

double schlick_rise(double cos_i, double exponent) { return std::pow(std::max(1.0 - cos_i, 0.0), exponent); }

// All entries of one roughness, for the tables with kCoarse points.
void integrate_coarse(std::vector<float>& table, int x, int n) {
  const double roughness = grid_value(x, kCoarse);
  for (int y = 0; y < kCoarse; ++y) {
    const VisibleNormals v(roughness, grid_value(y, kCoarse), n);
    // Cycles has the exponent as a third axis, 5 (1 - z) / z, and reads it at z = 1/2, between two of its points.
    const double two_slices = mean_rise(
        v, [](double c) { return 0.5 * (schlick_rise(c, 5.0 * 8.0 / 7.0) + schlick_rise(c, 5.0 * 7.0 / 8.0)); });
    table[HW_LUT_RISE_SCHLICK + y * kCoarse + x] = float(two_slices);
    for (int k = 0; k < kCoarse; ++k) {
      const double eta = slice_ior(k);
      const int at = (k * kCoarse + y) * kCoarse + x;
      const double f0 = (eta - 1.0) * (eta - 1.0) / ((eta + 1.0) * (eta + 1.0));
      const double rise = mean_rise(v, [=](double c) {
        double cos_t;
        return eta == 1.0 ? 0.0 : std::clamp((fresnel(c, eta, cos_t) - f0) / (1.0 - f0), 0.0, 1.0);
      });
      table[HW_LUT_RISE_IOR + at] = float(rise);
      table[HW_LUT_GLASS + at] = float(glass_albedo(v, eta));
      table[HW_LUT_GLASS_INV + at] = float(glass_albedo(v, 1.0 / eta));
    }
  }
  for (const auto& [u, weight] : gauss_legendre(kCoarse)) {
    // Uniform in cos^2 is the cosine-weighted hemisphere.
    const VisibleNormals v(roughness, std::sqrt(u), n);
    for (int k = 0; k < kCoarse; ++k) {
      table[HW_LUT_GLASS_MEAN + k * kCoarse + x] += float(weight * glass_albedo(v, slice_ior(k)));
      table[HW_LUT_GLASS_INV_MEAN + k * kCoarse + x] += float(weight * glass_albedo(v, 1.0 / slice_ior(k)));
    }
  }
}

void integrate_fine(std::vector<float>& table, int x, int n) {
  const double roughness = grid_value(x, kFine);
  for (int y = 0; y < kFine; ++y) {
    table[HW_LUT_E + y * kFine + x] = float(reflection_albedo(VisibleNormals(roughness, grid_value(y, kFine), n)));
  }
  double mean = 0.0;
  for (const auto& [u, weight] : gauss_legendre(kFine)) {
    mean += weight * reflection_albedo(VisibleNormals(roughness, std::sqrt(u), n));
  }
  table[HW_LUT_E_MEAN + x] = float(mean);
}

}  // namespace

std::vector<float> integrate_albedo_luts(int n) {
  std::vector<float> table(HW_LUT_SHEEN, 0.0f);
  // Every entry is written by one thread alone, in an order of its own: the result does not depend on the threads.
  const int threads = std::clamp(int(std::thread::hardware_concurrency()), 1, 16);
  std::vector<std::jthread> workers;
  for (int t = 0; t < threads; ++t) {
    workers.emplace_back([&table, t, threads, n] {
      for (int x = t; x < kFine; x += threads) integrate_fine(table, x, n);
      for (int x = t; x < kCoarse; x += threads) integrate_coarse(table, x, n);
    });
  }
  workers.clear();
  return table;
}

}  // namespace hw

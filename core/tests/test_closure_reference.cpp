// SPDX-License-Identifier: Apache-2.0
// Every closure against values measured in Cycles: albedos and f|cos| for one light direction at a time, no noise.
// closure_reference.inc is written by blender_tests/closure_reference.py, which says how they are measured.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "lib/closure_builders.h"
#include "lib/closures.h"

using namespace hw;

namespace {

struct Input {
  const char* name;
  vec3 value;
};
struct Reference {
  const char* name;
  const char* node;
  const char* distribution;
  bool bump, rotated;
  std::vector<Input> inputs;
  std::vector<float> values;
};

#include "closure_reference.inc"

constexpr int kPasses = 4;  // diffuse, glossy, transmission colour, emission

vec3 input(const Reference& r, const char* name, vec3 otherwise) {
  for (const Input& i : r.inputs) {
    if (std::strcmp(i.name, name) == 0) return i.value;
  }
  return otherwise;
}
float input(const Reference& r, const char* name, float otherwise) { return input(r, name, vec3(otherwise)).x; }

// Blender's defaults of the sockets.
PrincipledInputs principled_inputs(const Reference& r, vec3 N, vec3 Ns, vec3 tangent) {
  PrincipledInputs p;
  p.base_color = input(r, "Base_Color", vec3(0.8f));
  p.metallic = input(r, "Metallic", 0.0f);
  p.roughness = input(r, "Roughness", 0.5f);
  p.ior = input(r, "IOR", 1.5f);
  p.alpha = input(r, "Alpha", 1.0f);
  p.normal = N;
  p.diffuse_roughness = input(r, "Diffuse_Roughness", 0.0f);
  p.subsurface_weight = 0.0f;
  p.specular_ior_level = input(r, "Specular_IOR_Level", 0.5f);
  p.specular_tint = input(r, "Specular_Tint", vec3(1.0f));
  p.anisotropic = input(r, "Anisotropic", 0.0f);
  p.anisotropic_rotation = input(r, "Anisotropic_Rotation", 0.0f);
  p.tangent = tangent;
  p.transmission_weight = input(r, "Transmission_Weight", 0.0f);
  p.coat_weight = input(r, "Coat_Weight", 0.0f);
  p.coat_roughness = input(r, "Coat_Roughness", 0.03f);
  p.coat_ior = input(r, "Coat_IOR", 1.5f);
  p.coat_tint = input(r, "Coat_Tint", vec3(1.0f));
  p.coat_normal = Ns;
  p.sheen_weight = input(r, "Sheen_Weight", 0.0f);
  p.sheen_roughness = input(r, "Sheen_Roughness", 0.5f);
  p.sheen_tint = input(r, "Sheen_Tint", vec3(1.0f));
  p.emission_color = input(r, "Emission_Color", vec3(1.0f));
  p.emission_strength = input(r, "Emission_Strength", 0.0f);
  p.thin_film_thickness = 0.0f;
  p.thin_film_ior = 1.33f;
  p.multiscatter = std::strcmp(r.distribution, "MULTI_GGX") == 0;
  return p;
}

ClosureList build(const Reference& r, const ShadingGeometry& g, vec3& emission) {
  ClosureList list;
  const std::string node = r.node;
  vec3 N = r.bump ? normalize(g.Ns + kBump) : g.Ns;
  vec3 tangent = r.rotated ? kTangent : vec3(1.0f, 0.0f, 0.0f);
  vec3 color = input(r, "Color", vec3(0.8f));
  float anisotropy = input(r, "Anisotropy", 0.0f), rotation = input(r, "Rotation", 0.0f);
  uint multi = std::strcmp(r.distribution, "MULTI_GGX") == 0;
  if (node == "Principled") {
    emission = closures_add_principled(list, g, 1.0f, principled_inputs(r, N, g.Ns, tangent));
  } else if (node == "Diffuse") {
    closures_add_diffuse(list, g, 1.0f, color, input(r, "Roughness", 0.0f), N);
  } else if (node == "Translucent") {
    closures_add_translucent(list, g, 1.0f, color, N);
  } else if (node == "Anisotropic") {
    closures_add_glossy(list, g, 1.0f, color, input(r, "Roughness", 0.5f), anisotropy, rotation, N, tangent, multi);
  } else if (node == "Glass") {
    closures_add_glass(list, g, 1.0f, input(r, "Color", vec3(1.0f)), input(r, "Roughness", 0.0f), input(r, "IOR", 1.5f),
                       N, multi);
  } else if (node == "Refraction") {
    closures_add_refraction(list, g, 1.0f, color, input(r, "Roughness", 0.0f), input(r, "IOR", 1.45f), N);
  } else if (node == "Sheen") {
    closures_add_sheen(list, g, 1.0f, color, input(r, "Roughness", 0.5f), N);
  } else if (node == "MetallicF82") {
    closures_add_metallic_f82(list, g, 1.0f, input(r, "Base_Color", vec3(0.8f)), input(r, "Edge_Tint", vec3(0.8f)),
                              input(r, "Roughness", 0.5f), anisotropy, rotation, N, tangent, multi);
  } else if (node == "MetallicPhysical") {
    closures_add_metallic_conductor(list, g, 1.0f, input(r, "IOR", vec3(1.0f)), input(r, "Extinction", vec3(1.0f)),
                                    input(r, "Roughness", 0.5f), anisotropy, rotation, N, tangent, multi);
  } else if (node == "Toon") {
    closures_add_toon(list, g, 1.0f, color, input(r, "Size", 0.5f), input(r, "Smooth", 0.0f),
                      std::strcmp(r.distribution, "GLOSSY") == 0, N);
  } else {
    FAIL("no such node: ", node);
  }
  closures_finish(list);
  return list;
}

// Where we leave Cycles on purpose: light through facets that cannot be there (microfacet_refraction_exists).
bool departs(const ClosureList& list, const ShadingGeometry& g, vec3 wi) {
  for (uint i = 0; i < list.count; ++i) {
    const Closure& c = list.at[i];
    const bool transmits = closure_is_microfacet(c) && microfacet_transmits(c);
    if (transmits && dot(c.N, wi) < 0.0f && !microfacet_refraction_exists(c, g.wo, wi)) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("closures have Cycles' albedos and values") {
  int skipped = 0;
  const size_t cosines = std::size(kCosines), suns = std::size(kSuns);
  for (const Reference& r : kReferences) {
    double worst_albedo = 0.0, worst_value = 0.0, energy = 0.0, energy_reference = 0.0;
    std::string where;
    REQUIRE(r.values.size() == cosines * (kPasses + suns) * 3);
    for (size_t column = 0; column < cosines; ++column) {
      const float c = kCosines[column];
      ShadingGeometry g;
      g.wo = vec3(0.0f, 0.0f, 1.0f);
      g.Ng = g.Ns = vec3(std::sqrt(1.0f - c * c), 0.0f, c);
      g.flags = HW_SHADE_BUMP_CORRECTION;
      vec3 found[16] = {};
      const ClosureList list = build(r, g, found[3]);
      for (uint i = 0; i < list.count; ++i) {
        const Closure& k = list.at[i];
        const uint t = closure_type(k);
        if (t == HW_CLOSURE_TRANSPARENT) continue;
        if (closure_is_diffuse(k)) found[0] += closure_albedo(k, g.wo, true, true);
        if (t == HW_CLOSURE_GLOSSY || t == HW_CLOSURE_GLASS || t == HW_CLOSURE_GLOSSY_TOON)
          found[1] += closure_albedo(k, g.wo, true, false);
        if (t == HW_CLOSURE_REFRACTION || t == HW_CLOSURE_GLASS) found[2] += closure_albedo(k, g.wo, false, true);
      }
      for (size_t s = 0; s < suns; ++s) found[kPasses + s] = bsdf_value_total(closures_eval(list, g, kSuns[s]));
      const float* expected = &r.values[column * (kPasses + suns) * 3];
      for (size_t i = 0; i < (kPasses + suns) * 3; ++i) {
        if (i >= kPasses * 3 && departs(list, g, kSuns[i / 3 - kPasses])) {
          ++skipped;
          continue;
        }
        const double difference = std::abs(found[i / 3][int(i % 3)] - expected[i]);
        if (i < kPasses * 3) {
          worst_albedo = std::max(worst_albedo, difference);
        } else {
          energy += found[i / 3][int(i % 3)];
          energy_reference += expected[i];
          const double relative = difference / (std::abs(expected[i]) + 0.01);
          if (relative > worst_value) {
            worst_value = relative;
            where = "cos " + std::to_string(c) + " sun " + std::to_string(i / 3 - kPasses) + " channel " +
                    std::to_string(i % 3) + ": " + std::to_string(found[i / 3][int(i % 3)]) + " for " +
                    std::to_string(expected[i]);
          }
        }
      }
    }
    if (std::getenv("HW_VERBOSE"))
      std::printf("%-24s albedo %.1e value %.1e total %.5f  %s\n", r.name, worst_albedo, worst_value,
                  energy / std::max(energy_reference, 1e-9), where.c_str());
    CAPTURE(std::string(r.name));
    CAPTURE(where);
    CHECK(worst_albedo < 5e-4);
    CHECK(worst_value < 1e-3);
  }
  CHECK(skipped <= 3 * 68);  // channels of directions
}

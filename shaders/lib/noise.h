// SPDX-License-Identifier: Apache-2.0
// Gradient noise in 1 to 4 dimensions (Perlin 2002, "Improving noise") and its fractal sums (Musgrave, in Ebert et al.,
// "Texturing and modeling"), with the hash, gradients and ranges of Blender's Noise Texture.
#ifndef HW_NOISE_H
#define HW_NOISE_H
#include "../shared/material_program.h"
#include "hash.h"
HW_NAMESPACE_BEGIN

HW_FN float signed_if(float v, uint negative) { return negative != 0u ? -v : v; }

// Slope of a lattice point's gradient at an offset from it.
HW_FN float lattice_gradient(uint h, vec4 d, uint dims) {
  if (dims == 1u) {
    return signed_if(1.0f + float(h & 7u), h & 8u) * d.x;
  }
  uint h3 = h & 15u;
  uint h4 = h & 31u;
  float u;
  float v;
  float s = 0.0f;
  if (dims == 2u) {
    bool first = (h & 7u) < 4u;
    u = first ? d.x : d.y;
    v = 2.0f * (first ? d.y : d.x);
  } else if (dims == 3u) {
    u = h3 < 8u ? d.x : d.y;
    v = h3 < 4u ? d.y : (h3 == 12u || h3 == 14u ? d.x : d.z);
  } else {
    u = h4 < 24u ? d.x : d.y;
    v = h4 < 16u ? d.y : d.z;
    s = signed_if(h4 < 8u ? d.z : d.w, h & 4u);
  }
  return signed_if(u, h & 1u) + signed_if(v, h & 2u) + s;
}

// -1..1; p beyond the first `dims` components is ignored (and must be finite). Repeats every 100000.
HW_FN float signed_noise(vec4 p, uint dims) {
  const float period = 100000.0f;
  vec4 q = p / period;
  vec4 whole = sign(q) * floor(abs(q));
  vec4 far = step(vec4(1000000.0f), abs(p)) * 0.5f;
  vec4 r = p - whole * period + far;
  vec4 cell = floor(r);
  vec4 f = r - cell;
  vec4 t = f * f * f * (f * (f * 6.0f - vec4(15.0f)) + vec4(10.0f));
  float sum = 0.0f;
  uint corners = 1u << dims;
  for (uint i = 0u; i < corners; ++i) {
    vec4 corner = vec4(float(i & 1u), float((i >> 1u) & 1u), float((i >> 2u) & 1u), float((i >> 3u) & 1u));
    vec4 at = cell + corner;
    uint h = lookup3(uint(int(at.x)), uint(int(at.y)), uint(int(at.z)), uint(int(at.w)), dims);
    vec4 w = mix(vec4(1.0f) - t, t, corner);
    float weight = w.x * (dims > 1u ? w.y : 1.0f) * (dims > 2u ? w.z : 1.0f) * (dims > 3u ? w.w : 1.0f);
    sum += weight * lattice_gradient(h, f - corner, dims);
  }
  float scale = dims == 1u ? 0.25f : (dims == 2u ? 0.6616f : (dims == 3u ? 0.9820f : 0.8344f));
  return sum * scale;
}

struct NoiseParams {
  uint type;  // HW_NOISE_*
  uint dims;
  uint normalise;  // fBM only: 0..1
  float detail;    // octaves, 0..15
  float roughness;
  float lacunarity;
  float offset;
  float gain;
};

// The fractal sum of the chosen type. The loop runs over whole octaves and once more for the fraction of the last.
HW_FN float fractal_noise(vec4 p, NoiseParams n) {
  float octaves = floor(n.detail);
  float fraction = n.detail - octaves;
  uint type = n.type;
  bool product = type == HW_NOISE_MULTIFRACTAL;
  bool ridged = type == HW_NOISE_RIDGED;
  bool hybrid = type == HW_NOISE_HYBRID;
  bool terrain = type == HW_NOISE_HETERO_TERRAIN;
  float value = product ? 1.0f : 0.0f;
  float amplitude = 1.0f;
  float total = 0.0f;   // fBM: sum of amplitudes of whole octaves
  float whole = 0.0f;   // fBM: value of whole octaves
  float weight = 1.0f;  // hybrid, ridged
  float signal = 0.0f;
  float scale = 1.0f;
  int last = int(octaves) + (fraction != 0.0f && !ridged ? 1 : 0);
  for (int i = 0; i <= last; ++i) {
    bool partial = float(i) > octaves;
    float part = partial ? fraction : 1.0f;
    float s = signed_noise(p * scale, n.dims);
    if (type == HW_NOISE_FBM) {
      whole = partial ? whole : whole + s * amplitude;
      total = partial ? total : total + amplitude;
      value = whole + (partial ? s * amplitude : 0.0f);
    } else if (product) {
      value *= part * amplitude * s + 1.0f;
    } else if (hybrid) {
      weight = min(weight, 1.0f);
      signal = (s + n.offset) * amplitude;
      value += part * weight * signal;
      weight *= n.gain * signal;
      i = weight > 0.001f ? i : last;
    } else if (ridged) {
      weight = i == 0 ? 1.0f : clamp(signal * n.gain, 0.0f, 1.0f);
      signal = n.offset - abs(s);
      signal *= signal * weight;
      value += signal * amplitude;
    } else if (terrain) {
      value += i == 0 ? s + n.offset : part * (s + n.offset) * amplitude * value;
    }
    amplitude *= n.roughness;
    scale *= n.lacunarity;
  }
  if (type == HW_NOISE_FBM) {
    // `value` holds one more whole octave than `whole` when there is a fraction; amplitude is one step past it.
    float more = fraction != 0.0f && n.roughness > 0.0f ? amplitude / n.roughness : 0.0f;
    float a = n.normalise != 0u ? 0.5f * whole / total + 0.5f : whole;
    float b = n.normalise != 0u ? 0.5f * value / (total + more) + 0.5f : value;
    return fraction != 0.0f ? a + (b - a) * fraction : a;
  }
  return value;
}

// Offset that makes an independent noise out of the same function: 100..200 an axis, hashed from a seed.
HW_FN vec4 noise_seed_offset(float seed, uint dims) {
  if (dims == 1u) {
    return vec4(100.0f + 100.0f * hash_floats(seed, 0.0f, 0.0f, 0.0f, 1u), 0.0f, 0.0f, 0.0f);
  }
  return vec4(100.0f) + 100.0f * vec4(hash_floats(seed, 0.0f, 0.0f, 0.0f, 2u), hash_floats(seed, 1.0f, 0.0f, 0.0f, 2u),
                                      hash_floats(seed, 2.0f, 0.0f, 0.0f, 2u), hash_floats(seed, 3.0f, 0.0f, 0.0f, 2u));
}

// HW_OP_NOISE. `p` is already scaled; one-dimensional noise reads w. b = (w, detail, roughness), c = (lacunarity,
// distortion, offset). Result: the colour where `sub` asks for it, else the value in all components.
HW_FN vec3 noise_texture(uint sub, vec3 p3, vec3 b, vec3 c, float gain) {
  NoiseParams n;
  n.type = sub & 15u;
  n.dims = (sub >> 4u) & 15u;
  n.normalise = (sub >> 8u) & 1u;
  n.detail = clamp(b.y, 0.0f, 15.0f);
  n.roughness = max(b.z, 0.0f);
  n.lacunarity = c.x;
  n.offset = c.z;
  n.gain = gain;
  vec4 p = n.dims == 1u ? vec4(b.x, 0.0f, 0.0f, 0.0f)
                        : vec4(p3.x, p3.y, n.dims > 2u ? p3.z : 0.0f, n.dims > 3u ? b.x : 0.0f);
  if (c.y != 0.0f) {
    vec4 moved = p;
    for (uint i = 0u; i < n.dims; ++i) {
      float d = signed_noise(p + noise_seed_offset(float(i), n.dims), n.dims) * c.y;
      moved = moved + vec4(i == 0u ? d : 0.0f, i == 1u ? d : 0.0f, i == 2u ? d : 0.0f, i == 3u ? d : 0.0f);
    }
    p = moved;
  }
  vec3 result = vec3(0.0f);
  uint channels = ((sub >> 9u) & 1u) != 0u ? 3u : 1u;
  for (uint i = 0u; i < channels; ++i) {
    // Channels after the first are seeded past the distortion's seeds; in one dimension those are 1 and 2.
    vec4 shift = i == 0u ? vec4(0.0f) : noise_seed_offset(float(n.dims + i - 1u), n.dims);
    float v = fractal_noise(p + shift, n);
    result = i == 0u ? vec3(v) : (i == 1u ? vec3(result.x, v, v) : vec3(result.x, result.y, v));
  }
  return result;
}

HW_NAMESPACE_END
#endif

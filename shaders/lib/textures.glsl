// SPDX-License-Identifier: Apache-2.0
// Images by address: wrapping, filtering (closest, linear, cubic B-spline), box projection, transfer decoding. Filters,
// wrap modes and the order of operations are those of Cycles' image textures; texels are fetched and blended by hand, so
// that every device gives the same value.
#ifndef HW_TEXTURES_GLSL
#define HW_TEXTURES_GLSL
#include "../shared/material_program.h"
#include "color_ops.h"
#include "tables.glsl"
#include "words.glsl"

// Texel of a row-major image; x and y are in range.
vec4 image_texel(uint64_t texels, uint format, uint index) {
  if (!HW_HAS(HW_FEATURE_TEXEL_FORMATS) || format == HW_TEXEL_RGBA8) { return unpackUnorm4x8(uint_at(texels, index)); }
  if (format == HW_TEXEL_RGBA16F) {
    uint64_t h = word_at(texels, index);
    return vec4(unpackHalf2x16(word_low(h)), unpackHalf2x16(word_high(h)));
  }
  if (format == HW_TEXEL_R8) {
    float v = float(byte_at(texels, index)) * (1.0 / 255.0);
    return vec4(v, v, v, 1.0);
  }
  return vec4(word_floats(word_at(texels, 2u * index)), word_floats(word_at(texels, 2u * index + 1u)));
}

// Index of a texel after wrapping, -1 where it is clipped. Mirror counts edge texels twice. `i` is at most a few texels
// outside one period, so that the quotient by way of floats is right or one off; an integer division costs lavapipe one
// for each lane.
int image_wrap(int i, int size, uint extension) {
  int period = extension == HW_EXTENSION_MIRROR ? 2 * size : size;
  int m = i - period * int(floor(float(i) / float(period)));
  m = m < 0 ? m + period : (m >= period ? m - period : m);
  m = m >= size ? 2 * size - 1 - m : m;
  bool clipped = extension == HW_EXTENSION_CLIP && (i < 0 || i >= size);
  int clamped = clamp(i, 0, size - 1);
  int wrapped = extension == HW_EXTENSION_EXTEND || extension == HW_EXTENSION_CLIP ? clamped : m;
  return clipped ? -1 : wrapped;
}

// Weight of tap `i` of `taps` (1, 2: linear; 4: cubic B-spline) at the fraction f between the middle texels.
float image_tap_weight(int i, int taps, float f) {
  float d = abs(float(i - 1) - f);
  float near = (3.0 * d - 6.0) * d * d + 4.0;
  float far = 2.0 - d;
  float cubic = (d < 1.0 ? near : far * far * far) * (1.0 / 6.0);
  return taps == 4 ? cubic : (taps == 2 ? (i == 0 ? 1.0 - f : f) : 1.0);
}

// Keeps a coordinate finite and near the image without changing where it lands.
float image_coordinate(float x, uint extension) {
  float period = extension == HW_EXTENSION_MIRROR ? 2.0 : 1.0;
  float wrapped = x - period * floor(x / period);
  return extension == HW_EXTENSION_REPEAT || extension == HW_EXTENSION_MIRROR ? wrapped : clamp(x, -1.0, 2.0);
}

// As image_filtered, linear and repeated: what nearly all images are, without a loop.
vec4 image_linear_repeated(uint64_t texels, uint width, uint height, uint format, vec2 uv) {
  bool finite = abs(uv.x) < 1e18 && abs(uv.y) < 1e18;
  vec2 c = finite ? uv - floor(uv) : vec2(0.0);
  vec2 p = c * vec2(float(width), float(height)) - vec2(0.5);
  vec2 whole = floor(p);
  vec2 f = p - whole;
  // From -1 to the size.
  int w = int(width), h = int(height);
  int x0 = int(whole.x), y0 = int(whole.y);
  x0 = x0 < 0 ? x0 + w : min(x0, w - 1);
  y0 = y0 < 0 ? y0 + h : min(y0, h - 1);
  int x1 = x0 + 1 == w ? 0 : x0 + 1;
  int y1 = y0 + 1 == h ? 0 : y0 + 1;
  vec4 sum = (1.0 - f.x) * (1.0 - f.y) * image_texel(texels, format, uint(y0) * width + uint(x0));
  sum += f.x * (1.0 - f.y) * image_texel(texels, format, uint(y0) * width + uint(x1));
  sum += (1.0 - f.x) * f.y * image_texel(texels, format, uint(y1) * width + uint(x0));
  sum += f.x * f.y * image_texel(texels, format, uint(y1) * width + uint(x1));
  return finite ? sum : vec4(0.0);
}

// HW_OP_IMAGE without decoding: RGBA as stored, filtered.
vec4 image_filtered(uint64_t texels, uint width, uint height, uint format, vec2 uv, uint interpolation, uint extension) {
  bool finite = abs(uv.x) < 1e18 && abs(uv.y) < 1e18;
  int taps = interpolation == HW_INTERPOLATION_CLOSEST ? 1 : (interpolation == HW_INTERPOLATION_CUBIC ? 4 : 2);
  vec2 c = finite ? vec2(image_coordinate(uv.x, extension), image_coordinate(uv.y, extension)) : vec2(0.0);
  vec2 p = c * vec2(float(width), float(height)) - (taps == 1 ? vec2(0.0) : vec2(0.5));
  vec2 whole = floor(p);
  vec2 f = p - whole;
  int x0 = int(whole.x) - (taps == 4 ? 1 : 0);
  int y0 = int(whole.y) - (taps == 4 ? 1 : 0);
  vec4 sum = vec4(0.0);
  int tx = 0;
  int ty = 0;
  for (int i = 0; i < taps * taps; ++i) {
    int x = image_wrap(x0 + tx, int(width), extension);
    int y = image_wrap(y0 + ty, int(height), extension);
    if (x >= 0 && y >= 0) {
      float w = image_tap_weight(tx, taps, f.x) * image_tap_weight(ty, taps, f.y);
      sum += w * image_texel(texels, format, uint(y) * width + uint(x));
    }
    tx += 1;
    ty += tx == taps ? 1 : 0;
    tx = tx == taps ? 0 : tx;
  }
  return finite ? sum : vec4(0.0);
}

// Shares of the three axes' pictures for a box projection: the hexagon of the normal's direction is cut into three
// corners with one picture, three edges between two, and a middle with all three. n: |normal|, components sum to 1.
vec3 image_box_weights(vec3 n, float blend) {
  float limit = 0.5 * (1.0 + blend);
  bool only_x = n.x > limit * (n.x + n.y) && n.x > limit * (n.x + n.z);
  bool only_y = n.y > limit * (n.x + n.y) && n.y > limit * (n.y + n.z);
  bool only_z = n.z > limit * (n.x + n.z) && n.z > limit * (n.y + n.z);
  if (only_x) { return vec3(1.0, 0.0, 0.0); }
  if (only_y) { return vec3(0.0, 1.0, 0.0); }
  if (only_z) { return vec3(0.0, 0.0, 1.0); }
  if (blend <= 0.0) { return vec3(1.0, 0.0, 0.0); }
  float low = 0.5 * (1.0 - blend);
  float xy = clamp((n.x / max(n.x + n.y, 1e-20) - low) / blend, 0.0, 1.0);
  float yz = clamp((n.y / max(n.y + n.z, 1e-20) - low) / blend, 0.0, 1.0);
  float xz = clamp((n.x / max(n.x + n.z, 1e-20) - low) / blend, 0.0, 1.0);
  if (n.z < (1.0 - limit) * (n.y + n.x)) { return vec3(xy, 1.0 - xy, 0.0); }
  if (n.x < (1.0 - limit) * (n.y + n.z)) { return vec3(0.0, yz, 1.0 - yz); }
  if (n.y < (1.0 - limit) * (n.x + n.z)) { return vec3(xz, 0.0, 1.0 - xz); }
  return ((2.0 - limit) * n + vec3(limit - 1.0)) / (2.0 * limit - 1.0);
}

// HW_OP_IMAGE: linear RGB and alpha of image `image` (index into Root::images) at `co`. `normal`: object-space shading
// normal, read by the box projection only. A missing image is magenta.
vec4 image_texture(uint image, uint sub, vec3 co, vec3 normal) {
  uint64_t record = HW_ROOT.images + uint64_t(image) * HW_IMAGE_BYTES;
  uint64_t texels = word_at(record, 0u), size = word_at(record, 1u), kind = word_at(record, 2u);
  uint width = word_low(size);
  uint height = word_high(size);
  uint format = word_low(kind);
  uint flags = word_high(kind);
  uint interpolation = sub & 3u;
  uint extension = (sub >> 2u) & 3u;
  bool box = HW_HAS(HW_FEATURE_IMAGE_MODES) && ((sub >> 4u) & 3u) == HW_PROJECTION_BOX;
  bool missing = width == 0u || height == 0u;

  vec4 result = vec4(0.0);
  if (!missing) {
    vec3 n = abs(normal);
    n = n / max(n.x + n.y + n.z, 1e-20);
    vec3 weights = box ? image_box_weights(n, float(sub >> 8u) * (1.0 / 255.0)) : vec3(1.0, 0.0, 0.0);
    for (int axis = 0; axis < (box ? 3 : 1); ++axis) {
      float weight = axis == 0 ? weights.x : (axis == 1 ? weights.y : weights.z);
      vec2 uv = vec2(co.x, co.y);
      if (box) {
        float across = axis == 1 ? co.x : co.y;
        bool flip = axis == 0 ? normal.x < 0.0 : (axis == 1 ? normal.y > 0.0 : normal.z > 0.0);
        uv = vec2(flip ? 1.0 - across : across, axis == 2 ? co.x : co.z);
      }
      if (weight > 0.0) {
        vec4 r;
        if (HW_HAS(HW_FEATURE_IMAGE_MODES)) {
          r = image_filtered(texels, width, height, format, uv, interpolation, extension);
        } else {
          r = image_linear_repeated(texels, width, height, format, uv);
        }
        bool divide = (sub & HW_IMAGE_UNPREMULTIPLY) != 0u && (flags & HW_IMAGE_PREMULTIPLIED) != 0u && r.w != 0.0 && r.w != 1.0;
        vec3 rgb = divide ? r.xyz / r.w : r.xyz;
        if ((flags & HW_IMAGE_SRGB) != 0u) { rgb = vec3(srgb_to_linear(rgb.x), srgb_to_linear(rgb.y), srgb_to_linear(rgb.z)); }
        result += weight * vec4(rgb, r.w);
      }
    }
  }
  return missing ? vec4(1.0, 0.0, 1.0, 1.0) : result;
}
#endif

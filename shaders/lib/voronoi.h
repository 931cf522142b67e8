// SPDX-License-Identifier: Apache-2.0
// Cellular texture in 1 to 4 dimensions (Worley 1996), distance to edges after Quilez, fractal sum and smooth minimum
// as Blender's Voronoi Texture has them.
#ifndef HW_VORONOI_H
#define HW_VORONOI_H
#include "../shared/material_program.h"
#include "hash.h"
HW_NAMESPACE_BEGIN

struct VoronoiParams {
  uint feature;  // HW_VORONOI_*
  uint metric;   // HW_METRIC_*
  uint dims;
  float randomness;
  float smoothness;  // 0..0.5
  float exponent;    // Minkowski
};
struct VoronoiResult {
  float distance;
  vec3 color;
  vec4 position;  // x, y, z, w; in one dimension only w
};

// The feature point's offset within its cell, before randomness; and the cell's colour.
HW_FN vec4 voronoi_point(vec4 cell, uint dims) {
  if (dims == 1u) {
    return vec4(hash_floats(cell.x, 0.0f, 0.0f, 0.0f, 1u), 0.0f, 0.0f, 0.0f);
  }
  return pcg_unit(ivec4(int(cell.x), int(cell.y), int(cell.z), int(cell.w)), dims);
}
HW_FN vec3 voronoi_color(vec4 cell, uint dims) {
  if (dims == 1u) {
    return vec3(hash_floats(cell.x, 0.0f, 0.0f, 0.0f, 1u), hash_floats(cell.x, 1.0f, 0.0f, 0.0f, 2u),
                hash_floats(cell.x, 2.0f, 0.0f, 0.0f, 2u));
  }
  vec4 h = pcg_unit(ivec4(int(cell.x), int(cell.y), dims > 2u ? int(cell.z) : 0, int(cell.w)), dims > 3u ? 4u : 3u);
  return vec3(h.x, h.y, h.z);
}

// Unused dimensions are 0 in d.
HW_FN float voronoi_metric(vec4 d, VoronoiParams v) {
  vec4 a = abs(d);
  if (v.metric == HW_METRIC_MANHATTAN && v.dims > 1u) {
    return a.x + a.y + a.z + a.w;
  }
  if (v.metric == HW_METRIC_CHEBYCHEV && v.dims > 1u) {
    return max(max(a.x, a.y), max(a.z, a.w));
  }
  if (v.metric == HW_METRIC_MINKOWSKI && v.dims > 1u) {
    float e = v.exponent;
    float sum = 0.0f;
    sum += a.x > 0.0f ? pow(a.x, e) : (e == 0.0f ? 1.0f : 0.0f);
    sum += a.y > 0.0f ? pow(a.y, e) : (e == 0.0f ? 1.0f : 0.0f);
    sum += v.dims > 2u ? (a.z > 0.0f ? pow(a.z, e) : (e == 0.0f ? 1.0f : 0.0f)) : 0.0f;
    sum += v.dims > 3u ? (a.w > 0.0f ? pow(a.w, e) : (e == 0.0f ? 1.0f : 0.0f)) : 0.0f;
    return e != 0.0f && sum > 0.0f ? pow(sum, 1.0f / e) : 0.0f;
  }
  return sqrt(dot(d, d));
}

// Offset of neighbour `i` of a block `side` cells wide around the centre, x fastest; unused dimensions stay 0.
HW_FN vec4 voronoi_neighbour(int i, int side, uint dims) {
  int r = side / 2;
  int y = i / side;
  int z = y / side;
  return vec4(float(i % side - r), dims > 1u ? float(y % side - r) : 0.0f, dims > 2u ? float(z % side - r) : 0.0f,
              dims > 3u ? float((z / side) % side - r) : 0.0f);
}
HW_FN int voronoi_cells(int side, uint dims) {
  return side * (dims > 1u ? side : 1) * (dims > 2u ? side : 1) * (dims > 3u ? side : 1);
}

// One octave of F1, F2 or smooth F1.
HW_FN VoronoiResult voronoi_octave(vec4 p, VoronoiParams v) {
  vec4 cell = floor(p);
  vec4 local = p - cell;
  bool smooth_ = v.feature == HW_VORONOI_SMOOTH_F1 && v.smoothness > 0.0f;
  bool second = v.feature == HW_VORONOI_F2;
  int side = smooth_ ? 5 : 3;
  int count = voronoi_cells(side, v.dims);
  float best = HW_INFINITY;
  float next = HW_INFINITY;
  vec4 best_cell = vec4(0.0f);
  vec4 best_point = vec4(0.0f);
  vec4 next_cell = vec4(0.0f);
  vec4 next_point = vec4(0.0f);
  float blend_distance = 0.0f;
  vec3 blend_color = vec3(0.0f);
  vec4 blend_point = vec4(0.0f);
  vec4 used = vec4(1.0f, v.dims > 1u ? 1.0f : 0.0f, v.dims > 2u ? 1.0f : 0.0f, v.dims > 3u ? 1.0f : 0.0f);
  for (int i = 0; i < count; ++i) {
    vec4 offset = voronoi_neighbour(i, side, v.dims);
    vec4 point = offset + voronoi_point(cell + offset, v.dims) * v.randomness;
    float d = voronoi_metric(point - local, v);
    if (smooth_) {
      float h = clamp(0.5f + 0.5f * (blend_distance - d) / v.smoothness, 0.0f, 1.0f);
      h = i == 0 ? 1.0f : h * h * (3.0f - 2.0f * h);
      float correction = v.smoothness * h * (1.0f - h);
      blend_distance = blend_distance + (d - blend_distance) * h - correction;
      correction = correction / (1.0f + 3.0f * v.smoothness);
      blend_color = blend_color + (voronoi_color(cell + offset, v.dims) - blend_color) * h - vec3(correction);
      blend_point = blend_point + (point - blend_point) * h - used * correction;
    }
    bool nearer = d < best;
    bool second_nearer = !nearer && d < next;
    next_cell = nearer ? best_cell : (second_nearer ? offset : next_cell);
    next_point = nearer ? best_point : (second_nearer ? point : next_point);
    next = nearer ? best : (second_nearer ? d : next);
    best_cell = nearer ? offset : best_cell;
    best_point = nearer ? point : best_point;
    best = nearer ? d : best;
  }
  VoronoiResult r;
  r.distance = smooth_ ? blend_distance : (second ? next : best);
  r.color = blend_color;
  if (!smooth_) {
    r.color = voronoi_color(cell + (second ? next_cell : best_cell), v.dims);
  }
  vec4 at = cell + (smooth_ ? blend_point : (second ? next_point : best_point));
  r.position = v.dims == 1u ? vec4(0.0f, 0.0f, 0.0f, at.x) : at * used;
  return r;
}

// Distance to the nearest boundary between cells, Euclidean.
HW_FN float voronoi_edge(vec4 p, VoronoiParams v) {
  vec4 cell = floor(p);
  vec4 local = p - cell;
  int count = voronoi_cells(3, v.dims);
  vec4 closest = vec4(0.0f);
  float best = HW_INFINITY;
  for (int i = 0; i < count; ++i) {
    vec4 offset = voronoi_neighbour(i, 3, v.dims);
    vec4 to_point = offset + voronoi_point(cell + offset, v.dims) * v.randomness - local;
    float d = dot(to_point, to_point);
    closest = d < best ? to_point : closest;
    best = min(best, d);
  }
  float edge = HW_INFINITY;
  for (int i = 0; i < count; ++i) {
    vec4 offset = voronoi_neighbour(i, 3, v.dims);
    vec4 to_point = offset + voronoi_point(cell + offset, v.dims) * v.randomness - local;
    vec4 across = to_point - closest;
    float length2 = dot(across, across);
    if (v.dims == 1u) {
      // Blender measures one dimension from the cell's own point and its two neighbours.
      vec4 own = voronoi_point(cell, v.dims) * v.randomness;
      float d = abs(0.5f * (own.x - local.x + to_point.x));
      edge = offset.x != 0.0f ? min(edge, d) : edge;
    } else if (length2 > 0.0001f) {
      edge = min(edge, dot((closest + to_point) * 0.5f, across) / sqrt(length2));
    }
  }
  return edge;
}

// Half the distance from the nearest feature point to its own nearest neighbour.
HW_FN float voronoi_radius(vec4 p, VoronoiParams v) {
  vec4 cell = floor(p);
  vec4 local = p - cell;
  int count = voronoi_cells(3, v.dims);
  vec4 closest = vec4(0.0f);
  vec4 closest_cell = vec4(0.0f);
  float best = HW_INFINITY;
  for (int i = 0; i < count; ++i) {
    vec4 offset = voronoi_neighbour(i, 3, v.dims);
    vec4 point = offset + voronoi_point(cell + offset, v.dims) * v.randomness;
    vec4 to_point = point - local;
    float d = dot(to_point, to_point);
    closest = d < best ? point : closest;
    closest_cell = d < best ? offset : closest_cell;
    best = min(best, d);
  }
  float radius2 = HW_INFINITY;
  for (int i = 0; i < count; ++i) {
    vec4 step_ = voronoi_neighbour(i, 3, v.dims);
    vec4 offset = closest_cell + step_;
    vec4 to_point = offset + voronoi_point(cell + offset, v.dims) * v.randomness - closest;
    radius2 = dot(step_, step_) > 0.0f ? min(radius2, dot(to_point, to_point)) : radius2;
  }
  return 0.5f * sqrt(radius2);
}

// HW_OP_VORONOI. `p3` and b.x (w) are already scaled; b = (w, detail, roughness), c = (lacunarity, smoothness,
// exponent). Positions come out in scaled coordinates: the caller divides by the scale.
HW_FN vec3 voronoi_texture(uint sub, vec3 p3, vec3 b, vec3 c, float randomness) {
  VoronoiParams v;
  v.feature = sub & 7u;
  v.metric = (sub >> 3u) & 7u;
  v.dims = (sub >> 6u) & 7u;
  v.randomness = clamp(randomness, 0.0f, 1.0f);
  v.smoothness = clamp(0.5f * c.y, 0.0f, 0.5f);
  v.exponent = c.z;
  uint normalise = (sub >> 9u) & 1u;
  uint wanted = (sub >> 10u) & 3u;
  float detail = clamp(b.y, 0.0f, 15.0f);
  float roughness = clamp(b.z, 0.0f, 1.0f);
  float lacunarity = c.x;
  vec4 p = v.dims == 1u ? vec4(b.x, 0.0f, 0.0f, 0.0f)
                        : vec4(p3.x, p3.y, v.dims > 2u ? p3.z : 0.0f, v.dims > 3u ? b.x : 0.0f);
  if (v.feature == HW_VORONOI_N_SPHERE_RADIUS) {
    return vec3(voronoi_radius(p, v));
  }

  bool edge = v.feature == HW_VORONOI_DISTANCE_TO_EDGE;
  float reach = 0.5f + 0.5f * v.randomness;
  vec4 corner = vec4(reach, v.dims > 1u ? reach : 0.0f, v.dims > 2u ? reach : 0.0f, v.dims > 3u ? reach : 0.0f);
  float farthest = edge ? reach : voronoi_metric(corner, v) * (v.feature == HW_VORONOI_F2 ? 2.0f : 1.0f);

  bool single = detail == 0.0f || roughness == 0.0f;
  float whole = floor(detail);
  float fraction = detail - whole;
  int last = single ? 0 : int(whole) + (fraction != 0.0f ? 1 : 0);
  float amplitude = 1.0f;
  float scale = 1.0f;
  float total = edge ? farthest : 0.0f;
  float distance_ = edge ? 8.0f : 0.0f;
  vec3 color = vec3(0.0f);
  vec4 position = vec4(0.0f);
  for (int i = 0; i <= last; ++i) {
    float part = float(i) > whole ? fraction : 1.0f;
    if (edge) {
      float d = voronoi_edge(p * scale, v);
      float lerped = distance_ + (min(distance_, d / scale) - distance_) * amplitude;
      distance_ = single ? d : (part < 1.0f ? distance_ + (min(distance_, lerped) - distance_) * part : lerped);
      total = single ? total : total + (farthest / scale - total) * amplitude * part;
    } else {
      VoronoiResult o = voronoi_octave(p * scale, v);
      distance_ += o.distance * amplitude * part;
      color += o.color * (amplitude * part);
      position = position + (o.position * (1.0f / scale) - position) * (amplitude * part);
      total += amplitude * part;
    }
    scale *= lacunarity;
    amplitude *= roughness;
  }
  if (normalise != 0u) {
    distance_ = distance_ / (edge ? total : total * farthest);
    color = color * (1.0f / total);
  }
  return wanted == HW_VORONOI_OUT_DISTANCE
             ? vec3(distance_)
             : (wanted == HW_VORONOI_OUT_COLOR
                    ? color
                    : (wanted == HW_VORONOI_OUT_POSITION ? vec3(position.x, position.y, position.z)
                                                         : vec3(position.w)));
}

HW_NAMESPACE_END
#endif

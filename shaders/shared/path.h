// SPDX-License-Identifier: Apache-2.0
// What the stages of an integrator share during a frame: parameters, per-path state, pass slots of the film.
#ifndef HW_PATH_H
#define HW_PATH_H
#include "light_cells.h"
#include "portable.h"
#include "reuse.h"
HW_NAMESPACE_BEGIN

// Passes a film can hold; a set bit in FrameParams::passes means the pass is kept, at float offset pass_offset[bit]
// within a pixel's record of `film_stride` floats.
HW_CONST uint HW_PASS_COMBINED = 0u;        // 4: RGB, alpha
HW_CONST uint HW_PASS_DEPTH = 1u;           // 1, first sample, no filter
HW_CONST uint HW_PASS_POSITION = 2u;        // 3, first sample
HW_CONST uint HW_PASS_NORMAL = 3u;          // 3
HW_CONST uint HW_PASS_VECTOR = 4u;          // 4
HW_CONST uint HW_PASS_UV = 5u;              // 3
HW_CONST uint HW_PASS_MIST = 6u;            // 1
HW_CONST uint HW_PASS_OBJECT_INDEX = 7u;    // 1, first sample
HW_CONST uint HW_PASS_MATERIAL_INDEX = 8u;  // 1, first sample
HW_CONST uint HW_PASS_DENOISING_NORMAL = 9u;
HW_CONST uint HW_PASS_DENOISING_ALBEDO = 10u;
HW_CONST uint HW_PASS_DIFFUSE_DIRECT = 11u;
HW_CONST uint HW_PASS_DIFFUSE_INDIRECT = 12u;
HW_CONST uint HW_PASS_DIFFUSE_COLOR = 13u;
HW_CONST uint HW_PASS_GLOSSY_DIRECT = 14u;
HW_CONST uint HW_PASS_GLOSSY_INDIRECT = 15u;
HW_CONST uint HW_PASS_GLOSSY_COLOR = 16u;
HW_CONST uint HW_PASS_TRANSMISSION_DIRECT = 17u;
HW_CONST uint HW_PASS_TRANSMISSION_INDIRECT = 18u;
HW_CONST uint HW_PASS_TRANSMISSION_COLOR = 19u;
HW_CONST uint HW_PASS_EMISSION = 20u;
HW_CONST uint HW_PASS_ENVIRONMENT = 21u;
HW_CONST uint HW_PASS_DENOISING_DEPTH = 22u;
HW_CONST uint HW_PASS_COUNT = 23u;

// What a path is doing now. The ray-type bits say what made the current ray, as Cycles' Light Path node reports it.
HW_CONST uint HW_PATH_CAMERA = 1u;
HW_CONST uint HW_PATH_DIFFUSE = 2u;
HW_CONST uint HW_PATH_GLOSSY = 4u;
HW_CONST uint HW_PATH_TRANSMISSION = 8u;
HW_CONST uint HW_PATH_REFLECTION = 16u;
HW_CONST uint HW_PATH_SINGULAR = 32u;
HW_CONST uint HW_PATH_SHADOW = 64u;
HW_CONST uint HW_PATH_RAY_TYPES = 127u;
HW_CONST uint HW_PATH_BACKGROUND_VISIBLE = 128u;  // only transparent surfaces so far: a miss is the film's background
HW_CONST uint HW_PATH_EMISSION_ONLY = 256u;       // bounce limit reached: the next surface only emits (or lets through)
HW_CONST uint HW_PATH_NO_TRANSPARENT = 512u;      // transparent limit reached: ends at the next surface
HW_CONST uint HW_PATH_FIRST_DONE = 1024u;         // data passes have been written
HW_CONST uint HW_PATH_FEATURES_DONE = 2048u;      // denoising features have been written
HW_CONST uint HW_PATH_REUSED = 4096u;             // the pixel's reservoir has its surface
HW_CONST uint HW_PATH_SPLIT = 8192u;              // one of FrameParams::bounce_samples that left a surface
HW_CONST uint HW_PATH_ANCHOR = 16384u;            // path reuse: the surface here stays for the pixel's group
HW_CONST uint HW_PATH_FRESH = 32768u;             // path reuse: the next surface is where what is shared begins
HW_CONST uint HW_PATH_SHARED = 65536u;            // path reuse: it was met; light by it is shared (SharedVertex)

struct PathState {
  vec3 throughput;
  float mis_pdf;    // solid-angle pdf with which the BSDF chose this ray; 0: emission found counts in full
  vec3 mis_origin;  // where it was chosen
  float min_pdf;    // smallest such pdf on the path (Filter Glossy)
  uint pixel;       // index within the region, row by row from the bottom
  uint sample_index;
  uint flags;        // HW_PATH_*
  uint bounces;      // total | diffuse << 8 | glossy << 16 | transmission << 24
  uint transparent;  // transparent bounces
  uint seed;         // per-pixel hash for the sampler
  uint mis_normal;   // HW_RECEIVER_*: what a light would have been chosen for at mis_origin
  uint mis_cell;     // of light reuse at mis_origin; HW_NONE: none
};
HW_CONST uint HW_PATH_BYTES = 64u;
HW_CHECK_SIZE(PathState, HW_PATH_BYTES)

// A receiver of light as the choice of lights sees it: a normal, octahedral, whose lowest bit says that light may come
// from anywhere (HW_RECEIVER_TRANSMITS): something lets light through, or normals differ from closure to closure.
HW_CONST uint HW_RECEIVER_TRANSMITS = 1u;

// Where a path stands, written by the surface stage; its closures lie at closures[path * HW_MAX_CLOSURES].
struct SurfacePoint {
  vec3 position;
  vec3 normal;              // geometric, unit, on the side of the viewer
  vec3 shading_normal;      // interpolated, on the side of the viewer, before bump and normal maps
  vec3 terminator_offset;   // moves shadow rays off the facets of a smooth mesh (Cycles' geometry offset)
  float terminator_cutoff;  // cosine at the geometric normal below which it applies
  uint receiver;            // HW_RECEIVER_*: what lights are chosen for
  uint closure_count;
  uint flags;  // HW_SURFACE_* and HW_SHADE_*
};
HW_CONST uint HW_SURFACE_POINT_BYTES = 64u;
HW_CHECK_SIZE(SurfacePoint, HW_SURFACE_POINT_BYTES)
HW_CONST uint HW_SURFACE_SHADE_FLAGS = 255u;    // HW_SHADE_* (shared/closure.h)
HW_CONST uint HW_SURFACE_DELTA_ONLY = 256u;     // no closure a light sample could be evaluated for
HW_CONST uint HW_SURFACE_GLOSSY = 512u;         // most of it is a sharp reflection
HW_CONST uint HW_SURFACE_GIVES = 2048u;         // path reuse: scatters some light of every channel diffusely
HW_CONST uint HW_SURFACE_GIVES_GLOSSY = 8192u;  // path reuse: and its reflections are those that were sampled
HW_CONST uint HW_SURFACE_UNEVEN = 4096u;        // path reuse: its colour depends on where it is seen from
HW_CONST uint HW_SURFACE_WHOLE =
    1024u;  // lets light straight through, or sends it one way only: paths are not split here

// What a shadow ray carries: added to the path's result where it arrives. Shadow ray `number` of a path, of
// FrameParams::light_samples that it has places for, lies at path * light_samples + number, as do its ray and its
// result.
struct ShadowState {
  vec3 radiance;  // throughput * f * cos * Le / pdf * MIS weight; without Le until light_program.comp has run
  uint bounce;    // scatterings before the light, this one included; HW_SHADOW_SPLIT
  vec3 diffuse;   // share of radiance by lobe (first bounce), for the light passes
  uint light;     // index, for lights whose emission is a program
  vec3 glossy;
  uint transparent;  // transparent surfaces crossed so far
  vec2 uv;           // where on a triangle light, barycentrics as in Hit
  uint slot;         // of the light cell that proposed it (wssr-hash)
  float teaches;     // what the cell learns of each unit of luminance: 1 / that of the path's throughput
};
HW_CONST uint HW_SHADOW_SPLIT = 256u;         // beside the scatterings: its path is HW_PATH_SPLIT
HW_CONST uint HW_SHADOW_SHARED = 512u;        // its path is HW_PATH_SHARED,
HW_CONST uint HW_SHADOW_SHARED_HERE = 1024u;  // since this surface
HW_CONST uint HW_SHADOW_BYTES = 64u;
HW_CHECK_SIZE(ShadowState, HW_SHADOW_BYTES)

// Share of a path's throughput that left the first surface by the diffuse and glossy lobes; the rest is transmission.
struct PathSplit {
  vec3 diffuse;
  vec3 glossy;
  vec3 feature;  // what mirrors on the way leave of the denoising features
};
HW_CHECK_SIZE(PathSplit, 36)

// What a preparation finds of a pixel by two paths from it that are split in three: luminance of each, and the square
// of the difference of two of its parts, each a third.
struct SplitRecord {
  float light[2];
  float apart[2];
  float kept[2];  // the same square without what path reuse would share
};
HW_CHECK_SIZE(SplitRecord, 24)

// What adaptive sampling samples at once (core/session/adaptive_plan.h): all pixels of a block of so many on a side,
// once.
HW_CONST uint HW_BLOCK_SIDE = 4u;
HW_CONST uint HW_BLOCK_PIXELS = 16u;
struct SampledBlock {
  uint block;     // index within the region, row by row from the bottom
  uint sampling;  // HW_SAMPLE_*: number of the sample, half, binary logarithm of its weight
};
HW_CHECK_SIZE(SampledBlock, 8)
// Blocks along a side of so many pixels; the last may reach beyond.
HW_FN uint blocks_along(uint pixels) { return (pixels + HW_BLOCK_SIDE - 1u) / HW_BLOCK_SIDE; }
HW_CONST uint HW_SAMPLE_ODD = 1u << 27;  // it belongs to the other half of the pixel's samples
HW_CONST uint HW_SAMPLE_WEIGHT_SHIFT = 28u;
// Behind a pixel's passes, in films of weighted samples: the sum of weights, the same of the even half alone, and the
// sum of what that brought to Combined, 3.
HW_CONST uint HW_FILM_WEIGHTS = 5u;

// Path reuse (lib/path_reuse.glsl): pixels in a group, and the tile of the picture that holds eight groups.
HW_CONST uint HW_REUSE_PIXELS = 8u;
HW_CONST uint HW_REUSE_TILE_ROWS = 4u;
HW_CONST uint HW_REUSE_TILE = 64u;  // pixels

// The surface that a path meets after its pixel's anchor, one a path: where the light is that its group shares.
struct SharedVertex {
  vec3 arrival;  // throughput with which the path set out for it; in the end its light over all ways to find it
  uint kind;     // HW_SHARED_*
  vec3 position;
  uint normal;  // geometric, on the side it was seen from, octahedral
  vec3 light;   // what came by its even reflection, times the path's throughput
  uint glossy;  // 1: by a glossy reflection, 0: by a diffuse one
  vec3 share;   // even part of how the path went on from it
  uint pad1;
  vec3 light_share;  // even part of what its light sample reflects
  uint pad2;
};
HW_CONST uint HW_SHARED_VERTEX_BYTES = 80u;
HW_CHECK_SIZE(SharedVertex, HW_SHARED_VERTEX_BYTES)
HW_CONST uint HW_SHARED_NONE = 0u;
HW_CONST uint HW_SHARED_MET = 1u;    // `light` gathers
HW_CONST uint HW_SHARED_GIVEN = 2u;  // `arrival` is what each pixel of the group multiplies with its own part

// An anchor of a group that looks at a shared vertex of it.
struct SharedPair {
  vec3 f;     // what the anchor makes of the vertex' light: f cos cos / distance^2
  float pdf;  // of finding the vertex from here, by area; 0: it can't
};
HW_CONST uint HW_SHARED_PAIR_BYTES = 16u;
HW_CHECK_SIZE(SharedPair, HW_SHARED_PAIR_BYTES)

struct RayCounters {
  uint64_t camera, indirect, shadow, transparent_shadow;
};
HW_CHECK_SIZE(RayCounters, 32)

struct FrameParams {
  uint64_t paths;                // PathState[]
  uint64_t rays;                 // Ray[]
  uint64_t hits;                 // Hit[]
  uint64_t shadow_rays;          // Ray[]
  uint64_t shadow_hits;          // uint[]: 1 = blocked
  uint64_t shadow_surface_hits;  // Hit[]: the next transparent surface on a shadow ray
  uint64_t shadows;              // ShadowState[]
  uint64_t surfaces;             // SurfacePoint[]
  uint64_t closures;             // Closure[path_capacity * HW_MAX_CLOSURES]
  uint64_t splits;               // PathSplit[]
  uint64_t results;              // float[path_capacity * film_stride]
  uint64_t film;                 // float[pixels of the region * film_stride], sums over samples
  uint64_t counters;             // RayCounters
  uint64_t hit_queues[2];        // sorted hits by shading class (HW_MAX_SHADING_CLASSES)
  uint64_t program_queue;        // light samples whose emission is a program
  uint64_t sampled_blocks;       // SampledBlock[] of this pass, in adaptive sampling; 0: all pixels
  uint64_t shared_vertices;      // SharedVertex[]
  uint64_t shared_pairs;         // SharedPair[path_capacity * HW_REUSE_PIXELS]
  uint64_t shared_shares;        // vec3[]: of each pair's f, the diffuse part, for the light passes
  uint64_t shared_rays;          // Ray[]
  uint64_t shared_hits;          // uint[]: 1 = blocked
  uint width, height;            // full frame
  uint region_x, region_y, region_width, region_height;
  // This wave: pixels [first_pixel, first_pixel + wave_pixels), each with wave_samples paths; of `sampled_blocks`, one
  // block after the other.
  uint first_pixel;
  uint wave_pixels, wave_samples;
  uint first_sample;
  uint first_sample_of_render;  // passes that are not averaged are taken from this one
  uint seed;
  uint passes;             // bits by HW_PASS_*
  uint film_stride;        // of results, and of the film but for HW_FILM_WEIGHTS
  uint film_pixel_stride;  // of the film
  uint pass_offset[23];
  uint max_bounces, max_diffuse, max_glossy, max_transmission, max_transparent, min_bounces;
  float clamp_direct, clamp_indirect;  // sums of |rgb|; HW_INFINITY: off
  float filter_glossy;                 // 1 / the setting; HW_INFINITY: off
  uint filter_type;                    // HW_FILTER_* (lib/filter.h)
  float filter_width;
  uint caustics;          // bit 0 reflective, bit 1 refractive
  uint transparent_film;  // bit 0: on, bit 1: transparent glass
  float pass_alpha_threshold;
  float mist_start, mist_inverse_depth, mist_falloff;  // falloff: exponent
  uint frame_flags;                                    // HW_FRAME_*
  uint light_samples;                                  // at the first surface of a path
  uint bounce_samples;                                 // paths that go on from the first surface that scatters light
  uint places;  // of a path of the camera: bounce_samples; with path reuse one more
  uint pad;
  uint pixels_a_path;     // above 1: a path for one pixel of so many, drawn at random
  uint preparation_seed;  // of that draw
  ReuseFrame reuse;
  LightCellFrame light_cells;  // wssr-hash
};
HW_CHECK_SIZE(FrameParams, 792)
HW_CONST uint HW_FRAME_BSDF_HITS_EMIT =
    1u;  // something that emits can be hit by BSDF rays: trace them at the last bounce
HW_CONST uint HW_FRAME_SURFACES_DARK = 2u;  // no material emits or lets light straight through
HW_CONST uint HW_FRAME_MISSES_DARK = 4u;    // nothing shines behind everything: no world, no sun

HW_NAMESPACE_END
#endif

// SPDX-License-Identifier: Apache-2.0
// What the stages of an integrator share during a frame: parameters, per-path state, pass slots of the film.
#ifndef HW_PATH_H
#define HW_PATH_H
#include "portable.h"
HW_NAMESPACE_BEGIN

// Passes a film can hold; a set bit in FrameParams::passes means the pass is kept, at float offset pass_offset[bit]
// within a pixel's record of `film_stride` floats.
HW_CONST uint HW_PASS_COMBINED = 0u;       // 4: RGB, alpha
HW_CONST uint HW_PASS_DEPTH = 1u;          // 1, first sample, no filter
HW_CONST uint HW_PASS_POSITION = 2u;       // 3, first sample
HW_CONST uint HW_PASS_NORMAL = 3u;         // 3
HW_CONST uint HW_PASS_VECTOR = 4u;         // 4
HW_CONST uint HW_PASS_UV = 5u;             // 3
HW_CONST uint HW_PASS_MIST = 6u;           // 1
HW_CONST uint HW_PASS_OBJECT_INDEX = 7u;   // 1, first sample
HW_CONST uint HW_PASS_MATERIAL_INDEX = 8u; // 1, first sample
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
HW_CONST uint HW_PASS_COUNT = 22u;

HW_NAMESPACE_END
#endif

// SPDX-License-Identifier: Apache-2.0
// Specialisation constants of the stages beside shared/features.h: the passes a film keeps.
#ifndef HW_FEATURES_GLSL
#define HW_FEATURES_GLSL
#include "../shared/features.h"

layout(constant_id = 1) const uint HW_PASSES = 1u;            // bits by HW_PASS_*
layout(constant_id = 2) const bool HW_LIGHT_PASSES = false;   // light is split by lobe for some pass
#define HW_FEATURE_PASSES \
  ((HW_PASSES & (1u << HW_PASS_DENOISING_NORMAL | 1u << HW_PASS_DENOISING_ALBEDO | 1u << HW_PASS_DENOISING_DEPTH)) != 0u)
#endif

// SPDX-License-Identifier: Apache-2.0
// The push constant that every stage shares: what the host tells this dispatch.
#ifndef HW_PUSH_GLSL
#define HW_PUSH_GLSL
#include "../shared/portable.h"

layout(push_constant, scalar) uniform Push {
  uint64_t queue;       // the queue this dispatch works through; 0: dispatch is over all paths or pixels
  uint64_t out_queue;   // where it appends
  uint64_t out_queue2;
  uint a, b, c, d;      // per stage
} push;

#endif

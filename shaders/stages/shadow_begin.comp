// SPDX-License-Identifier: Apache-2.0
// Shadow rays that no opaque surface stopped are sent on to look for surfaces that let light through; until they have,
// they count as stopped.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint shadow = queued(gl_GlobalInvocationID.x);
  if (UintBuffer(HW_FRAME.shadow_hits).at[shadow] != 0u) return;
  UintBuffer(HW_FRAME.shadow_hits).at[shadow] = 1u;
  RayArray(HW_FRAME.shadow_rays).at[shadow].mask = HW_MASK_SHADOW_TRANSPARENT;
  queue_push(push.out_queue, shadow);
}

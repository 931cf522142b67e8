// SPDX-License-Identifier: Apache-2.0
// Adds the light samples whose shadow rays arrived.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  if (UintBuffer(HW_FRAME.shadow_hits).at[path] == 0u) {
    ShadowState s = ShadowArray(HW_FRAME.shadows).at[path];
    result_add_light(path, s.radiance, s.bounce, s.diffuse, s.glossy);
  }
}

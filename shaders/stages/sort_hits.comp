// SPDX-License-Identifier: Apache-2.0
// Sorts traced paths by what comes next: out_queue: those that met a surface; out_queue2: those that met a lamp or nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  uint instance = HitArray(HW_FRAME.hits).at[path].instance;
  queue_push(instance < HW_LAMP_INSTANCE ? push.out_queue : push.out_queue2, path);
}

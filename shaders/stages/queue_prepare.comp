// SPDX-License-Identifier: Apache-2.0
// Turns a queue's count into indirect dispatch arguments, adds it to a ray counter, and empties the queues that the next
// stages append to. One thread. a: which counter (0 camera, 1 indirect, 2 shadow, 3 transparent shadow, 4 none).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 1) in;

void main() {
  if (push.queue != 0ul) {
    QueueRef q = QueueRef(push.queue);
    // 65535: what every device can dispatch. Waves stay below; who may not goes through its queue in strides.
    q.header.groups_x = min((q.header.count + HW_GROUP_SIZE - 1u) / HW_GROUP_SIZE, 65535u);
    q.header.groups_y = 1u;
    q.header.groups_z = 1u;
    q.header.launch_height = 1u;
    q.header.launch_depth = 1u;
    CounterBuffer c = CounterBuffer(HW_FRAME.counters);
    uint64_t n = uint64_t(q.header.count);
    if (push.a == 0u) c.counters.camera += n;
    if (push.a == 1u) c.counters.indirect += n;
    if (push.a == 2u) c.counters.shadow += n;
    if (push.a == 3u) c.counters.transparent_shadow += n;
  }
  if (push.out_queue != 0ul) QueueRef(push.out_queue).header.count = 0u;
  if (push.out_queue2 != 0ul) QueueRef(push.out_queue2).header.count = 0u;
}

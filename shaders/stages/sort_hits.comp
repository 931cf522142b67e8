// SPDX-License-Identifier: Apache-2.0
// Sorts traced paths by what comes next: a surface, in the queue of its object's shading class; or a lamp or nothing
// (out_queue).
// A path past its last bounce ends here when the object it met neither emits nor lets light through: running its material
// would find nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  uint instance = uint_at(HW_FRAME.hits + uint64_t(path) * HW_HIT_BYTES, 3u);
  if (instance == HW_BLOCKED_INSTANCE) return;
  bool surface = instance < HW_LAMP_INSTANCE;
  uint flags = uint_at(HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES, 10u);
  bool emission_only = (flags & HW_PATH_EMISSION_ONLY) != 0u;
  if (surface && emission_only && (!HW_FEATURE_PASSES || (flags & HW_PATH_FEATURES_DONE) != 0u)) {
    uint64_t record = HW_ROOT.instances + uint64_t(instance) * HW_INSTANCE_BYTES;
    bool emits = uint_at(record, 2u * HW_INSTANCE_WORD_LIGHT) != HW_NONE;
    bool through = (uint_at(record, 2u * HW_INSTANCE_WORD_MESH + 3u) & HW_MASK_SHADOW_TRANSPARENT) != 0u;
    if (!emits && !through) return;
  }
  uint64_t target = push.out_queue;
  if (surface) {
    uint shading_class = (uint_at(HW_ROOT.instances + uint64_t(instance) * HW_INSTANCE_BYTES, 2u * HW_INSTANCE_WORD_FLAGS + 1u) >> HW_INSTANCE_CLASS_SHIFT) & 1u;
    target = shading_class == 0u ? HW_FRAME.hit_queues[0] : HW_FRAME.hit_queues[1];
  }
  queue_push(target, path);
}

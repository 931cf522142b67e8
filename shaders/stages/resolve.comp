// SPDX-License-Identifier: Apache-2.0
// Adds the light samples of shaded paths whose shadow rays arrived. resolve_cells also teaches the cells that proposed
// them how much light came from which part of their cut.
// a: light samples of each path.
// variant resolve_cells: HW_CELLS_LEARN
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/path_reuse.glsl"
#include "lib/wave.glsl"
#ifdef HW_CELLS_LEARN
#include "lib/light_cell_learn.glsl"
#endif
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  vec3 sum = vec3(0.0);
  bool arrived = false;
  for (uint number = 0u; number < push.a; ++number) {
    uint shadow = shadow_of(path, number);
    if (uint_at(HW_FRAME.shadow_hits, shadow) != 0u) continue;
    ShadowState s = shadow_load(shadow);
    uint bounce = s.bounce & (HW_SHADOW_SPLIT - 1u);
    vec3 v = result_clamp(s.radiance, bounce, (s.bounce & HW_SHADOW_SPLIT) != 0u);
    if (HW_PATH_REUSE) {
      if ((s.bounce & HW_SHADOW_SHARED) != 0u) v -= reuse_put(path, v, (s.bounce & HW_SHADOW_SHARED_HERE) != 0u);
    }
    sum += result_value(v);
    result_add_light_passes(path, v, bounce, s.diffuse, s.glossy);
    arrived = true;
#ifdef HW_CELLS_LEARN
    light_cell_learn(uint_at(HW_CELLS.visited, path), s);
#endif
  }
  if (arrived) result_add3(path, HW_PASS_COMBINED, sum);
}

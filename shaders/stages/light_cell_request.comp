// SPDX-License-Identifier: Apache-2.0
// Of the surfaces whose cell is missing, those whose tag their bucket settled on say where that cell lies. Several may:
// they write the same.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_cell_lookup.glsl"
#include "lib/reuse.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  LightCellKey key = light_cell_of(path_load(path), surface_load(path), target_surface(reuse_surface_load(HW_REUSE.targets, path)));
  LightCellRequestArray requests = LightCellRequestArray(HW_CELLS.requests);
  uint bucket = light_cell_bucket(key);
  if (requests.at[bucket].tag != key.tag) return;
  requests.at[bucket].center = key.center;
}

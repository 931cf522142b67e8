// SPDX-License-Identifier: Apache-2.0
// Of the surfaces whose cell is missing, those whose tag their bucket settled on say where that cell lies. Several may:
// they write the same.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  LightCellRequest wanted = LightCellRequestArray(HW_CELLS.wanted).at[path];
  LightCellRequestArray requests = LightCellRequestArray(HW_CELLS.requests);
  if (requests.at[wanted.bucket].tag == wanted.tag) requests.at[wanted.bucket].center = wanted.center;
}

// SPDX-License-Identifier: Apache-2.0
// What each leaf of the tree saw, for the host to grow and prune it by. One thread a leaf. a: how many, c: the first,
// out_queue: LeafSurvey[a].
#version 460
#extension GL_GOOGLE_include_directive : require
#define HW_CELLS_TREE
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  uint leaf = push.c + gl_GlobalInvocationID.x;
  if (leaf >= push.a) return;
  LeafSurvey seen;
  seen.position = vec3(0.0);
  seen.witness = vec3(0.0);
  seen.pass = 0u;
  seen.load = 0u;
  for (uint slot = 0u; slot < HW_REUSE.cell_slots; ++slot) {
    uint i = leaf * HW_REUSE.cell_slots + slot;
    RecordCell cell = RecordCellArray(HW_REUSE.record_cells).at[i];
    bool newer = slot == 0u || cell.seen > seen.pass;
    if (cell.seen < seen.pass) continue;
    seen.pass = cell.seen;
    seen.load = newer ? cell.load : seen.load + cell.load;
    if (cell.load == 0u) continue;
    // Of several slots: the first's record and the last's witness lie apart more often than one slot's two.
    if (newer) seen.position = record_surface(i).position;
    seen.witness = WitnessArray(HW_REUSE.witnesses).at[i];
  }
  SurveyArray(push.out_queue).at[leaf] = seen;
}

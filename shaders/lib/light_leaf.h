// SPDX-License-Identifier: Apache-2.0
// LightLeaf (shared/light_cells.h): a light's proxy, packed.
#ifndef HW_LIGHT_LEAF_H
#define HW_LIGHT_LEAF_H
#include "../shared/light_cells.h"
#include "../shared/reuse.h"
#include "packed_float.h"
HW_NAMESPACE_BEGIN

// `light`: index, below 2^HW_LIGHT_LEAF_FLAGS.
HW_FN LightLeaf light_leaf_pack(HW_IN(LightProxy) p, uint light) {
  LightLeaf l;
  l.center = p.center;
  l.intensity = p.intensity;
  l.axis = p.axis;
  l.emission = p.emission;
  l.extent = upper_float_above(p.area) | (upper_float_above(p.radius) << 16u);
  l.light = light | (p.flags << HW_LIGHT_LEAF_FLAGS);
  return l;
}

// `chance`: of the light being chosen, above 0.
HW_FN LightProxy light_leaf_proxy(HW_IN(LightLeaf) l, float chance) {
  LightProxy p;
  p.center = l.center;
  p.radius = upper_float_high(l.extent);
  p.axis = l.axis;
  p.emission = l.emission;
  p.intensity = l.intensity;
  p.area = upper_float_low(l.extent);
  p.inverse_choice = 1.0f / chance;
  p.flags = l.light >> HW_LIGHT_LEAF_FLAGS;
  p.threshold = 0.0f;
  p.alias = 0u;
  return p;
}
HW_FN uint light_leaf_index(HW_IN(LightLeaf) l) { return l.light & ((1u << HW_LIGHT_LEAF_FLAGS) - 1u); }

HW_NAMESPACE_END
#endif

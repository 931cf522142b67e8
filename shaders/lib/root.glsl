// SPDX-License-Identifier: Apache-2.0
// The scene's root, a uniform of every kernel (shared/tables.h).
#ifndef HW_ROOT_GLSL
#define HW_ROOT_GLSL
#include "../shared/tables.h"

layout(set = 0, binding = 0, scalar) uniform RootBlock { Root root; } hw_root;

#define HW_ROOT hw_root.root
#endif

// SPDX-License-Identifier: Apache-2.0
// Volk's implementation, Vulkan's entry points, in a unit of its own: it is large, and not ours to instrument.
#define VOLK_IMPLEMENTATION
#include <volk.h>

// SPDX-License-Identifier: Apache-2.0
// Positive numbers as the upper halves of floats: their whole range at three digits, for a shift.
#ifndef HW_PACKED_FLOAT_H
#define HW_PACKED_FLOAT_H
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

// The least that is not below x >= 0; the largest for what is larger.
HW_FN uint upper_float_above(float x) { return min((floatBitsToUint(x) + 0xFFFFu) >> 16u, 0x7F7Fu); }
// The nearest to x >= 0.
HW_FN uint upper_float_near(float x) { return min((floatBitsToUint(x) + 0x8000u) >> 16u, 0x7F7Fu); }
// Of the number in the lower and in the upper half of a word.
HW_FN float upper_float_low(uint word) { return uintBitsToFloat(word << 16u); }
HW_FN float upper_float_high(uint word) { return uintBitsToFloat(word & 0xFFFF0000u); }

HW_NAMESPACE_END
#endif

// SPDX-License-Identifier: Apache-2.0
// What a kernel reads of its specialisation constants, found in its SPIR-V. Constants whose difference a kernel does
// not read make the same kernel twice, and a kernel costs seconds to make.
#pragma once

#include <cstdint>
#include <map>
#include <span>

#include "gpu/device.h"

namespace hw {

// constant_id → the bits that are read. All of them, where a constant is used otherwise than in `constant & literal`
// (SPIR-V: OpSpecConstantOp BitwiseAnd with an OpConstant). Constants that are not there are not read. `words` is a
// whole SPIR-V module; one that is cut short reads all bits of what it declares.
std::map<std::uint32_t, std::uint32_t> bits_read(std::span<const std::uint32_t> words);

// The part of `given` that is read, by constant_id.
SpecConstants only_read(const std::map<std::uint32_t, std::uint32_t>& bits, const SpecConstants& given);

}  // namespace hw

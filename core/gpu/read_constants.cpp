// SPDX-License-Identifier: Apache-2.0
// One walk over the instructions of a module (SPIR-V specification 1.6, sections 2.3 and 3.52).
#include "gpu/read_constants.h"

#include <algorithm>

namespace hw {

namespace {

// Numbers of the specification's tables, as far as they are needed here.
enum Op : std::uint32_t {
  kSourceContinued = 2,
  kSource = 3,
  kSourceExtension = 4,
  kName = 5,
  kMemberName = 6,
  kString = 7,
  kLine = 8,
  kExtension = 10,
  kExtInstImport = 11,
  kMemoryModel = 14,
  kEntryPoint = 15,
  kExecutionMode = 16,
  kCapability = 17,
  kConstant = 43,
  kSpecConstantTrue = 48,
  kSpecConstantFalse = 49,
  kSpecConstant = 50,
  kSpecConstantOp = 52,
  kDecorate = 71,
  kMemberDecorate = 72,
  kBitwiseAnd = 199,
};
constexpr std::uint32_t kSpecId = 1;  // a decoration
constexpr std::size_t kHeader = 5;    // words before the first instruction

// Instructions that only speak of a constant, or whose operands are no ids.
bool reads_nothing(std::uint32_t op) {
  switch (op) {
    case kSourceContinued:
    case kSource:
    case kSourceExtension:
    case kName:
    case kMemberName:
    case kString:
    case kLine:
    case kExtension:
    case kExtInstImport:
    case kMemoryModel:
    case kEntryPoint:
    case kExecutionMode:
    case kCapability:
    case kConstant:
    case kSpecConstantTrue:
    case kSpecConstantFalse:
    case kSpecConstant:
    case kDecorate:
    case kMemberDecorate:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::map<std::uint32_t, std::uint32_t> bits_read(std::span<const std::uint32_t> words) {
  std::map<std::uint32_t, std::uint32_t> bits;       // by constant_id
  std::map<std::uint32_t, std::uint32_t> constants;  // result id → constant_id
  std::map<std::uint32_t, std::uint32_t> literals;   // result id → value of 32 bits
  std::size_t at = kHeader;
  while (at < words.size()) {
    const std::uint32_t op = words[at] & 0xFFFFu, count = words[at] >> 16;
    if (count == 0 || count > words.size() - at) break;
    const auto operands = words.subspan(at + 1, count - 1);
    at += count;
    if (op == kDecorate && count == 4 && operands[1] == kSpecId) {
      constants[operands[0]] = operands[2];
      bits[operands[2]] = 0;
    } else if (op == kConstant && count == 4) {
      literals[operands[1]] = operands[2];
    }
    if (reads_nothing(op)) continue;
    if (op == kSpecConstantOp && count == 6 && operands[2] == kBitwiseAnd) {
      const auto left = constants.find(operands[3]), right = constants.find(operands[4]);
      const auto mask = literals.find(operands[left != constants.end() ? 4 : 3]);
      if (mask != literals.end() && (left == constants.end()) != (right == constants.end())) {
        bits[left != constants.end() ? left->second : right->second] |= mask->second;
        continue;
      }
    }
    // A literal that happens to be a constant's id makes too much of it, never too little.
    for (const std::uint32_t operand : operands)
      if (const auto found = constants.find(operand); found != constants.end()) bits[found->second] = ~0u;
  }
  if (at < words.size())
    for (auto& [id, read] : bits) read = ~0u;
  return bits;
}

SpecConstants only_read(const std::map<std::uint32_t, std::uint32_t>& bits, const SpecConstants& given) {
  SpecConstants read;
  for (const auto& [id, value] : given)
    if (const auto found = bits.find(id); found != bits.end()) read.emplace_back(id, value & found->second);
  std::sort(read.begin(), read.end());
  return read;
}

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
#include "materials/program_check.h"

#include <array>
#include <bitset>

#include "shared/features.h"
#include "shared/material_program.h"

namespace hw {
namespace {

struct OpInfo {
  const char* name = nullptr;  // null: no such opcode
  uint operands = 0;
  uint features = 0;
};

const std::array<OpInfo, 256>& op_table() {
  static const std::array<OpInfo, 256> table = [] {
    std::array<OpInfo, 256> t{};
#define HW_OP_INFO_(name, code, operands, features) t[code] = OpInfo{#name, operands, features};
    HW_MATERIAL_OPS(HW_OP_INFO_)
#undef HW_OP_INFO_
    return t;
  }();
  return table;
}

struct Row {
  explicit Row(const std::uint32_t* w)
      : op(w[0] & 255u), dst(w[0] >> 8u & 255u), sub(w[0] >> 16u), imm(w[3]), operand{w[1] & 0xFFFFu, w[1] >> 16u,
                                                                                      w[2] & 0xFFFFu, w[2] >> 16u,
                                                                                      w[3] & 0xFFFFu, w[3] >> 16u} {}
  uint op, dst, sub, imm;
  std::array<uint, 6> operand;  // a .. f
};

uint tier_of(uint op) {
  if (op < HW_TIER_CORE_END) return 0;
  if (op < HW_TIER_LOOKUP_END) return 1;
  return op < HW_TIER_PROCEDURAL_END ? 2 : 3;
}

// Why a variant or immediate is not one the interpreter knows; null if it is.
const char* check_variant(const Row& r, const ProgramView& p) {
  switch (r.op) {
    case HW_OP_COMBINE:
      return (r.sub & 3u) > 2u || (r.sub >> 2u & 3u) > 2u || (r.sub >> 4u) > 2u ? "component out of range" : nullptr;
    case HW_OP_MATH:
      return r.sub > HW_MATH_TANH ? "unknown function" : nullptr;
    case HW_OP_MATRIX:
      return std::size_t(r.imm) + 3 > p.constant_count ? "matrix lies outside the constants" : nullptr;
    case HW_OP_TABLE:
      return std::size_t(r.imm) + (r.sub & HW_TABLE_ENTRIES) + 1 > p.constant_count ? "table lies outside the constants"
                                                                                    : nullptr;
    case HW_OP_INPUT:
      return (r.sub & 255u) >= HW_INPUT_COUNT || r.sub >> 8u > 2u ? "unknown input" : nullptr;
    case HW_OP_ATTRIBUTE:
      return (r.sub & 255u) > HW_ATTRIBUTE_EXISTS || r.sub >> 8u > 2u ? "unknown attribute variant" : nullptr;
    case HW_OP_TRANSFORM:
      return (r.sub & 3u) > HW_SPACE_CAMERA || (r.sub >> 2u & 3u) > HW_SPACE_CAMERA ||
                     r.sub >> 4u > HW_TRANSFORM_AS_NORMAL
                 ? "unknown space"
                 : nullptr;
    case HW_OP_IMAGE:
      if (r.imm >= p.image_count) return "image index outside the material's images";
      if ((r.sub & 3u) > HW_INTERPOLATION_CUBIC || (r.sub >> 4u & 3u) > HW_PROJECTION_BOX) return "unknown sampling";
      return r.operand[3] != 0 && (r.operand[3] < HW_REGISTER_FIRST_FREE || r.operand[3] >= HW_VM_REGISTERS)
                 ? "alpha register out of range"
                 : nullptr;
    case HW_OP_ENVIRONMENT:
      return r.sub > 1u ? "unknown projection" : nullptr;
    case HW_OP_COLOR:
      return r.sub > HW_COLOR_HSL_TO_RGB ? "unknown conversion" : nullptr;
    case HW_OP_NORMAL_MAP:
      return r.sub > HW_NORMAL_MAP_WORLD ? "unknown space" : nullptr;
    case HW_OP_FRESNEL:
      return r.sub > 1u ? "unknown variant" : nullptr;
    case HW_OP_NOISE: {
      const uint dims = r.sub >> 4u & 15u;
      return (r.sub & 15u) > HW_NOISE_HETERO_TERRAIN || dims < 1u || dims > 4u ? "unknown noise" : nullptr;
    }
    case HW_OP_VORONOI: {
      const uint dims = r.sub >> 6u & 7u;
      return (r.sub & 7u) > HW_VORONOI_N_SPHERE_RADIUS || (r.sub >> 3u & 7u) > HW_METRIC_MINKOWSKI || dims < 1u ||
                     dims > 4u
                 ? "unknown Voronoi"
                 : nullptr;
    }
    case HW_OP_WHITE_NOISE:
      return (r.sub & 15u) < 1u || (r.sub & 15u) > 4u ? "dimensions out of range" : nullptr;
    case HW_OP_MAGIC:
      return r.sub > 10u ? "depth out of range" : nullptr;
    default:
      return nullptr;
  }
}

std::string where(const char* section, std::size_t row, const std::string& reason) {
  return std::string(section) + " section, row " + std::to_string(row) + ": " + reason;
}

std::string check_section(const ProgramView& p, const char* name, std::size_t first) {
  const std::size_t rows = p.word_count / 4;
  std::bitset<HW_VM_REGISTERS> written;
  for (uint i = 0; i < HW_REGISTER_FIRST_FREE; ++i) written.set(i);
  uint closures = 0;
  uint arguments = 0;  // rows of arguments still owed to the last closure
  for (std::size_t i = first; i < rows; ++i) {
    const Row r(p.words + 4 * i);
    const OpInfo& info = op_table()[r.op];
    if (!info.name) return where(name, i, "unknown opcode " + std::to_string(r.op));
    if ((r.op == HW_OP_ARGUMENTS) != (arguments > 0)) return where(name, i, "arguments do not follow their closure");
    if (r.op == HW_OP_END) return {};
    // The interpreter may load operands that a row does not use: those must lie within the constants too.
    const uint loaded = tier_of(r.op) == 3 ? 6 : (r.op == HW_OP_IMAGE ? 3 : 4);
    for (uint k = 0; k < loaded; ++k) {
      const uint o = r.operand[k];
      if (o & HW_OPERAND_CONSTANT) {
        if ((o & 0x7FFFu) >= p.constant_count)
          return where(name, i, "constant " + std::to_string(o & 0x7FFFu) + " does not exist");
      } else if ((info.operands >> k & 1u) && (o >= HW_VM_REGISTERS || !written.test(o))) {
        return where(name, i, "register " + std::to_string(o) + " read before it is written");
      }
    }
    if (const char* reason = check_variant(r, p)) return where(name, i, std::string(info.name) + ": " + reason);
    if (tier_of(r.op) < 3) {
      if (closures) return where(name, i, "a value after the first closure");
      if (r.dst < HW_REGISTER_FIRST_FREE || r.dst >= HW_VM_REGISTERS)
        return where(name, i, "destination register out of range");
      written.set(r.dst);
      if (r.op == HW_OP_IMAGE && r.operand[3] != 0) written.set(r.operand[3]);
    } else if (arguments > 0) {
      --arguments;
    } else {
      if (++closures > HW_VM_MAX_CLOSURE_ROWS) return where(name, i, "too many closures");
      arguments = r.op == HW_OP_PRINCIPLED ? 2u : 0u;
    }
  }
  return where(name, rows, "no end");
}

// The operand's value if it is a constant's component, else `varies`.
float constant_or(const ProgramView& p, uint operand, uint component, float varies) {
  return operand & HW_OPERAND_CONSTANT ? p.constants[4 * (operand & 0x7FFFu) + component] : varies;
}

uint principled_features(const ProgramView& p, const std::uint32_t* w) {
  const Row r0(w), r1(w + 4), r2(w + 8);
  uint f = HW_FEATURE_GLOSSY;
  if (constant_or(p, r0.operand[1], 0, 1) > 0) f |= HW_FEATURE_METALLIC;
  if (constant_or(p, r0.operand[3], 0, 0) < 1) f |= HW_FEATURE_TRANSPARENT;
  if (constant_or(p, r0.operand[3], 1, 1) > 0) f |= HW_FEATURE_ROUGH_DIFFUSE;
  if (constant_or(p, r0.operand[5], 1, 1) != 0) f |= HW_FEATURE_ANISOTROPY;
  if (constant_or(p, r1.operand[2], 0, 1) > 0) f |= HW_FEATURE_TRANSMISSION;
  if (constant_or(p, r1.operand[3], 0, 1) > 0) f |= HW_FEATURE_COAT;
  if (constant_or(p, r2.operand[0], 0, 1) > 0) f |= HW_FEATURE_SHEEN;
  if (r0.operand[2] != HW_REGISTER_NORMAL || r1.operand[5] != HW_REGISTER_NORMAL) f |= HW_FEATURE_BUMP;
  if (r0.sub & 1u) f |= HW_FEATURE_MULTISCATTER;
  return f;
}

uint closure_features(const ProgramView& p, const std::uint32_t* w) {
  const Row r(w);
  uint f = 0;
  const bool microfacet = r.op == HW_OP_GLOSSY || r.op == HW_OP_GLASS || r.op == HW_OP_METALLIC;
  if (microfacet && (r.sub & 3u) == HW_DISTRIBUTION_MULTI_GGX) f |= HW_FEATURE_MULTISCATTER;
  if ((r.op == HW_OP_GLOSSY || r.op == HW_OP_METALLIC) && constant_or(p, r.operand[1], 1, 1) != 0)
    f |= HW_FEATURE_ANISOTROPY;
  if (r.op >= HW_OP_DIFFUSE && r.op <= HW_OP_METALLIC && r.operand[2] != HW_REGISTER_NORMAL) f |= HW_FEATURE_BUMP;
  switch (r.op) {
    case HW_OP_DIFFUSE:
      return f | (constant_or(p, r.operand[1], 0, 1) > 0 ? HW_FEATURE_ROUGH_DIFFUSE : 0u);
    case HW_OP_TRANSLUCENT:
      return f | HW_FEATURE_TRANSLUCENT;
    case HW_OP_GLOSSY:
      return f | HW_FEATURE_GLOSSY;
    case HW_OP_GLASS:
    case HW_OP_REFRACTION:
      return f | HW_FEATURE_TRANSMISSION | HW_FEATURE_GLOSSY;
    case HW_OP_SHEEN:
      return f | HW_FEATURE_SHEEN;
    case HW_OP_TOON:
      return f | HW_FEATURE_TOON;
    case HW_OP_METALLIC:
      return f | HW_FEATURE_GLOSSY | (r.sub & HW_METALLIC_CONDUCTOR ? HW_FEATURE_CONDUCTOR : HW_FEATURE_METALLIC);
    case HW_OP_TRANSPARENT:
      return f | HW_FEATURE_TRANSPARENT;
    case HW_OP_PRINCIPLED:
      return f | principled_features(p, w);
    case HW_OP_IMAGE:  // interpolation, extension and projection: 0 is linear, repeated, flat
      return f | ((r.sub & 63u) != 0 ? HW_FEATURE_IMAGE_MODES : 0u);
    default:
      return f;
  }
}

}  // namespace

std::string check_program(const ProgramView& p) {
  if (p.word_count == 0) return {};
  if (p.word_count % 4 != 0 || p.word_count / 4 > HW_VM_MAX_ROWS)
    return "a program has whole rows of 4 words, at most " + std::to_string(HW_VM_MAX_ROWS);
  if (p.constant_count > HW_VM_MAX_CONSTANTS) return "more than " + std::to_string(HW_VM_MAX_CONSTANTS) + " constants";
  if (p.words[0] != HW_PROGRAM_MAGIC) return "not a material program of this version";
  static const char* const kNames[] = {"", "surface", "emission", "transparency"};
  for (uint s = HW_SECTION_SURFACE; s <= HW_SECTION_TRANSPARENCY; ++s) {
    const std::size_t first = p.words[s];
    if (first == 0) continue;
    if (first >= p.word_count / 4) return std::string(kNames[s]) + " section starts outside the program";
    if (std::string reason = check_section(p, kNames[s], first); !reason.empty()) return reason;
  }
  return {};
}

std::uint32_t program_features(const ProgramView& p) {
  uint features = 0;
  for (std::size_t i = 1; i < p.word_count / 4; ++i) {
    const std::uint32_t* w = p.words + 4 * i;
    features |= op_table()[w[0] & 255u].features << HW_FEATURE_VM_SHIFT;
    features |= closure_features(p, w);
  }
  return features;
}

bool program_depends_on_view(const ProgramView& p) {
  for (std::size_t i = 1; i < p.word_count / 4; ++i) {
    const Row r(p.words + 4 * i);
    const uint input = r.sub & 255u;
    if (r.op == HW_OP_FRESNEL) return true;
    if (r.op == HW_OP_INPUT && (input == HW_INPUT_REFLECTION || input == HW_INPUT_RAY_LENGTH_DEPTH_DIFFUSE))
      return true;
    const uint operands = op_table()[r.op].operands;
    for (uint k = 0; k < r.operand.size(); ++k)
      if ((operands >> k & 1u) && r.operand[k] == HW_REGISTER_INCOMING) return true;
  }
  return false;
}

void patch_program_images(std::uint32_t* words, std::size_t word_count,
                          const std::function<std::uint32_t(std::uint32_t)>& use) {
  for (std::size_t i = 4; i + 4 <= word_count; i += 4) {
    if ((words[i] & 255u) == HW_OP_IMAGE) words[i + 3] = use(words[i + 3]);
  }
}

bool program_reads_attribute(const ProgramView& p, std::uint32_t hash) {
  for (std::size_t i = 1; i < p.word_count / 4; ++i) {
    const Row r(p.words + 4 * i);
    if (hash != 0 && (r.op == HW_OP_ATTRIBUTE || r.op == HW_OP_NORMAL_MAP) && r.imm == hash) return true;
    if (hash != 0) continue;
    const uint operands = op_table()[r.op].operands;
    for (uint k = 0; k < r.operand.size(); ++k) {
      if ((operands >> k & 1u) && r.operand[k] == HW_REGISTER_UV) return true;
    }
    if (r.op == HW_OP_NORMAL_MAP ||
        (r.op == HW_OP_INPUT && ((r.sub & 255u) == HW_INPUT_UV || (r.sub & 255u) == HW_INPUT_TANGENT)))
      return true;
  }
  return false;
}

}  // namespace hw

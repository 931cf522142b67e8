// SPDX-License-Identifier: Apache-2.0
#include "materials/program_reference.h"

#include <algorithm>
#include <array>

#include "lib/color_ops.h"
#include "lib/equirect.h"
#include "lib/fresnel.h"
#include "lib/math_ops.h"
#include "lib/noise.h"
#include "lib/patterns.h"
#include "lib/voronoi.h"

namespace hw {
namespace {

class Machine {
 public:
  Machine(const ProgramView& program, const ReferenceInputs& inputs) : program_(program), inputs_(inputs) {
    registers_[HW_REGISTER_UV] = inputs.uv;
    registers_[HW_REGISTER_POSITION] = inputs.position;
    registers_[HW_REGISTER_NORMAL] = inputs.normal;
    registers_[HW_REGISTER_INCOMING] = inputs.incoming;
  }

  ReferenceOutput run(uint section) {
    ReferenceOutput out;
    if (program_.word_count == 0 || program_.words[section] == 0) return out;
    for (row_ = program_.words + 4 * program_.words[section]; op() != HW_OP_END; row_ += 4) {
      if (op() < HW_TIER_PROCEDURAL_END) {
        registers_[row_[0] >> 8u & 255u] = value();
      } else {
        if (op() == HW_OP_EMISSION) out.emission += operand(0);
        if (op() == HW_OP_TRANSPARENT) out.transparency += operand(0);
        if (op() == HW_OP_HOLDOUT) out.holdout += operand(0);
        if (op() >= HW_OP_DIFFUSE && op() <= HW_OP_PRINCIPLED) ++out.closures;
      }
    }
    return out;
  }

 private:
  uint op() const { return row_[0] & 255u; }
  uint sub() const { return row_[0] >> 16u; }
  const float* constant(std::size_t i) const { return program_.constants + 4 * i; }
  vec3 operand(uint i) const {
    const uint o = row_[1 + i / 2] >> (i % 2 * 16u) & 0xFFFFu;
    if (!(o & HW_OPERAND_CONSTANT)) return registers_[o % HW_VM_REGISTERS];
    const float* c = constant(o & 0x7FFFu);
    return {c[0], c[1], c[2]};
  }
  float table(float x, uint component) const {
    const float last = float(sub() & HW_TABLE_ENTRIES);
    const bool step = (sub() & HW_TABLE_STEP) != 0u;
    const float at = std::clamp(x, 0.0f, 1.0f) * last;
    const float low = step ? std::floor(at) : std::min(std::floor(at), std::max(last - 1.0f, 0.0f));
    const bool beyond = (sub() & HW_TABLE_EXTRAPOLATE) != 0u && (x < 0.0f || x > 1.0f);
    const float t = beyond ? x * last - low : (step ? 0.0f : at - low);
    const float a = constant(row_[3] + std::size_t(low))[component];
    const float b = constant(row_[3] + std::size_t(std::min(low + 1.0f, last)))[component];
    return a + (b - a) * t;
  }
  vec3 table_row(vec3 a) const {
    const bool alpha = (sub() & HW_TABLE_ALPHA) != 0u;
    return {table(a.x, alpha ? 3 : 0), table(a.y, alpha ? 3 : 1), table(a.z, alpha ? 3 : 2)};
  }
  vec3 matrix_row(vec3 a) const {
    vec3 r(0.0f);
    for (int i = 0; i < 3; ++i) {
      const float* m = constant(row_[3] + i);
      r[i] = m[0] * a.x + m[1] * a.y + m[2] * a.z + m[3];
    }
    return r;
  }
  float fresnel(float ior, vec3 normal) const {
    const float cosine = dot(inputs_.incoming, normal);
    const float eta = std::max(ior, 1e-5f);
    float cos_t;
    return sub() == 1u ? std::abs(cosine) : fresnel_dielectric(cosine, inputs_.backfacing ? 1.0f / eta : eta, cos_t);
  }
  vec3 image_row(vec3 a) {
    const vec4 texel = inputs_.image ? inputs_.image(row_[3], sub(), a) : vec4(1, 0, 1, 1);
    if (const uint alpha = row_[2] >> 16u; alpha >= HW_REGISTER_FIRST_FREE) registers_[alpha] = vec3(texel.w);
    return {texel.x, texel.y, texel.z};
  }
  vec3 environment(vec3 a) const {
    const float length2 = dot(a, a);
    if (sub() == 0u && length2 == 0.0f) return vec3(0.0f);
    return {sub() == 0u ? equirect_from_direction(a / std::sqrt(length2)) : mirror_ball_from_direction(a), 0.0f};
  }
  vec3 value() {
    const vec3 a = operand(0), b = operand(1), c = operand(2), d = op() == HW_OP_IMAGE ? vec3(0.0f) : operand(3);
    switch (op()) {
      case HW_OP_MATH:
        return vec3(scalar_function(sub(), a.x, b.x));
      case HW_OP_MATRIX:
        return matrix_row(a);
      case HW_OP_TABLE:
        return table_row(a);
      case HW_OP_COLOR:
        return color_convert(sub(), a);
      case HW_OP_FRESNEL:
        return vec3(fresnel(a.x, b));
      case HW_OP_IMAGE:
        return image_row(a);
      case HW_OP_ENVIRONMENT:
        return environment(a);
      case HW_OP_INPUT:
      case HW_OP_ATTRIBUTE:
      case HW_OP_TRANSFORM:
      case HW_OP_BUMP:
      case HW_OP_NORMAL_MAP:
        return inputs_.scene ? inputs_.scene(op(), sub(), row_[3], a) : vec3(0.0f);
      case HW_OP_NOISE:
        return noise_texture(sub(), a, b, c, d.x);
      case HW_OP_VORONOI:
        return voronoi_texture(sub(), a, b, c, d.x);
      case HW_OP_WHITE_NOISE:
        return white_noise(sub(), a, b.x);
      case HW_OP_MAGIC:
        return magic_texture(sub(), a, c.x, b.x);
      case HW_OP_BRICK:
        return brick_texture(sub(), a, b, c, d.x);
      default:
        return core_op(op(), sub(), a, b, c);
    }
  }

  const ProgramView& program_;
  const ReferenceInputs& inputs_;
  std::array<vec3, HW_VM_REGISTERS> registers_{};
  const std::uint32_t* row_ = nullptr;
};

}  // namespace

ReferenceOutput run_program(const ProgramView& program, uint section, const ReferenceInputs& inputs) {
  return Machine(program, inputs).run(section);
}

}  // namespace hw

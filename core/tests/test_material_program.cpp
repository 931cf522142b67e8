// SPDX-License-Identifier: Apache-2.0
// Material programs: the checker refuses what the interpreter must not see, features follow the constants, and the
// host's interpreter computes what the format says.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "materials/program_check.h"
#include "materials/program_reference.h"
#include "shared/features.h"

using namespace hw;

namespace {

constexpr uint K = HW_OPERAND_CONSTANT;

struct Program {
  std::vector<std::uint32_t> words{HW_PROGRAM_MAGIC, 0, 0, 0};
  std::vector<float> constants{0, 0, 0, 0, 1, 1, 1, 0, 0.25f, -2, 3, 0};  // 0, 1, (0.25, -2, 3)
  std::size_t images = 0;

  Program& row(uint op, uint dst, uint sub, uint a = 0, uint b = 0, uint c = 0, uint d = 0, uint imm = 0) {
    words.insert(words.end(), {op | dst << 8 | sub << 16, a | b << 16, c | d << 16, imm});
    return *this;
  }
  Program& section(uint which) {
    words[which] = std::uint32_t(words.size() / 4);
    return *this;
  }
  ProgramView view() const { return {words.data(), words.size(), constants.data(), constants.size() / 4, images}; }
};

Program emitting(uint op, uint sub, uint a, uint b = K, uint c = K, uint imm = 0) {
  Program p;
  p.section(HW_SECTION_EMISSION).row(op, 4, sub, a, b, c, 0, imm).row(HW_OP_EMISSION, 0, 0, 4).row(HW_OP_END, 0, 0);
  return p;
}

vec3 value_of(const Program& p, const ReferenceInputs& in = {}) {
  REQUIRE(check_program(p.view()) == "");
  return run_program(p.view(), HW_SECTION_EMISSION, in).emission;
}

}  // namespace

TEST_CASE("a well-formed program is accepted and computes") {
  ReferenceInputs in;
  in.uv = {0.5f, 0.25f, 0};
  const vec3 v = value_of(emitting(HW_OP_FMA, 0, HW_REGISTER_UV, K | 2, K | 1), in);
  CHECK(v.x == doctest::Approx(1.125));
  CHECK(v.y == doctest::Approx(0.5));
  CHECK(v.z == doctest::Approx(1.0));
  CHECK(check_program({}) == "");  // nothing at all: a black surface
}

TEST_CASE("division by zero and powers without a value give zero") {
  CHECK(value_of(emitting(HW_OP_DIV, 0, K | 1, K)) == vec3(0));
  CHECK(value_of(emitting(HW_OP_MATH, HW_MATH_LOG, K, K | 1)) == vec3(0));
  CHECK(value_of(emitting(HW_OP_NORMALIZE, 0, K)) == vec3(0));
}

TEST_CASE("the checker names what is wrong") {
  const auto refused = [](const Program& p, const char* part) {
    const std::string reason = check_program(p.view());
    INFO(reason);
    CHECK(reason.find(part) != std::string::npos);
  };
  refused(emitting(HW_OP_FMA, 0, 9), "register 9 read before");
  refused(emitting(HW_OP_FMA, 0, K | 3), "constant 3 does not exist");
  refused(emitting(HW_OP_TABLE, 3, 0, K, K, 0), "table lies outside");
  refused(emitting(HW_OP_MATRIX, 0, 0, K, K, 1), "matrix lies outside");
  refused(emitting(HW_OP_IMAGE, 0, 0, K, K, 0), "image index");
  refused(emitting(HW_OP_NOISE, 5u << 4, 0), "unknown noise");
  refused(emitting(HW_OP_COMBINE, 3, 0), "component");
  refused(emitting(200, 0, 0), "unknown opcode");
  Program p = emitting(HW_OP_MIN, 0, 0);
  p.words.resize(p.words.size() - 4);
  refused(p, "no end");
  p = emitting(HW_OP_MIN, 0, 0);
  p.words[HW_SECTION_EMISSION] = 1000;
  refused(p, "outside the program");
  p = emitting(HW_OP_MIN, 0, 0);
  p.words[0] = 7;
  refused(p, "not a material program");
  p = emitting(HW_OP_MIN, 0, 0);
  p.words[4] = HW_OP_MIN | 2u << 8;  // writes an input
  refused(p, "destination register");
  p = {};
  p.section(HW_SECTION_SURFACE).row(HW_OP_PRINCIPLED, 0, 1, K, K, 2, K, K | K << 16).row(HW_OP_END, 0, 0);
  refused(p, "arguments do not follow");
  p = {};
  p.section(HW_SECTION_SURFACE).row(HW_OP_EMISSION, 0, 0, K).row(HW_OP_MIN, 4, 0, 0, 0).row(HW_OP_END, 0, 0);
  refused(p, "a value after the first closure");
  p = {};
  p.section(HW_SECTION_SURFACE);
  for (uint i = 0; i <= HW_VM_MAX_CLOSURE_ROWS; ++i) p.row(HW_OP_EMISSION, 0, 0, K);
  refused(p.row(HW_OP_END, 0, 0), "too many closures");
}

TEST_CASE("random words are refused, or run within bounds") {
  std::mt19937 random(7);
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    Program p = emitting(HW_OP_MIN, 0, 0);
    p.images = 2;
    const int changes = 1 + int(random() % 3);
    for (int k = 0; k < changes; ++k) {
      const std::size_t at = 4 + random() % (p.words.size() - 4);
      p.words[at] = random() % 2 ? p.words[at] ^ (1u << random() % 32) : std::uint32_t(random());
    }
    if (check_program(p.view()) != "") continue;
    ++accepted;
    run_program(p.view(), HW_SECTION_EMISSION, {});  // sanitizers watch
  }
  CHECK(accepted > 100);
}

TEST_CASE("features follow the rows and their constants") {
  Program p;
  p.section(HW_SECTION_SURFACE)
      .row(HW_OP_PRINCIPLED, 0, 0, K, K, HW_REGISTER_NORMAL, K | 1, (K | 1) | K << 16)
      .row(HW_OP_ARGUMENTS, 0, 0, K, K, K, K, K | HW_REGISTER_NORMAL << 16)
      .row(HW_OP_ARGUMENTS, 0, 0, K, K, K, K, K | K << 16)
      .row(HW_OP_END, 0, 0);
  REQUIRE(check_program(p.view()) == "");
  const uint plain = program_features(p.view());
  CHECK((plain & HW_FEATURE_GLOSSY) != 0);
  CHECK((plain & (HW_FEATURE_METALLIC | HW_FEATURE_COAT | HW_FEATURE_SHEEN | HW_FEATURE_TRANSMISSION |
                  HW_FEATURE_TRANSPARENT)) == 0);
  CHECK((plain >> HW_FEATURE_VM_SHIFT & HW_VM_PRINCIPLED) != 0);
  p.words[5] = K | (K | 1u) << 16;  // metallic 1
  CHECK((program_features(p.view()) & HW_FEATURE_METALLIC) != 0);
  p.words[5] = K | HW_REGISTER_UV << 16;  // metallic varies
  CHECK((program_features(p.view()) & HW_FEATURE_METALLIC) != 0);
}

TEST_CASE("programs that read where they are seen from are told") {
  const auto depends = [](const Program& p) {
    REQUIRE(check_program(p.view()) == "");
    return program_depends_on_view(p.view());
  };
  CHECK(!depends(emitting(HW_OP_FMA, 0, HW_REGISTER_UV, K | 2, K | 1)));
  CHECK(!depends(emitting(HW_OP_FMA, 0, HW_REGISTER_NORMAL, K | 2, K | 1)));
  CHECK(depends(emitting(HW_OP_FMA, 0, K | 1, K | 2, HW_REGISTER_INCOMING)));
  CHECK(!depends(emitting(HW_OP_MIN, 0, K | 1, K | 2, HW_REGISTER_INCOMING)));  // an operand it does not have
  CHECK(depends(emitting(HW_OP_FRESNEL, 0, K | 1, HW_REGISTER_NORMAL)));
  CHECK(depends(emitting(HW_OP_INPUT, HW_INPUT_REFLECTION, K)));
  CHECK(depends(emitting(HW_OP_INPUT, HW_INPUT_RAY_LENGTH_DEPTH_DIFFUSE, K)));
}

TEST_CASE("image indices are patched and attributes found") {
  Program p = emitting(HW_OP_IMAGE, 0, HW_REGISTER_UV, K, K, 1);
  p.images = 2;
  REQUIRE(check_program(p.view()) == "");
  CHECK(program_reads_attribute(p.view(), 0));
  CHECK_FALSE(program_reads_attribute(p.view(), 77));
  patch_program_images(p.words.data(), p.words.size(), [](std::uint32_t i) { return i + 40; });
  CHECK(p.words[7] == 41);
  CHECK(program_reads_attribute(emitting(HW_OP_ATTRIBUTE, 0, K, K, K, 77).view(), 77));
}

TEST_CASE("noise stays in its range and is smooth") {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-50, 50);
  Program p;
  p.constants.insert(p.constants.end(), {0, 0, 0.5f, 0, 2, 0, 0, 0});  // (w, detail, roughness), (lacunarity, ...)
  p.section(HW_SECTION_EMISSION)
      .row(HW_OP_NOISE, 4, HW_NOISE_FBM | 3u << 4 | 1u << 8, HW_REGISTER_POSITION, K | 3, K | 4, K)
      .row(HW_OP_EMISSION, 0, 0, 4)
      .row(HW_OP_END, 0, 0);
  float low = 1, high = 0;
  for (int i = 0; i < 4000; ++i) {
    ReferenceInputs in;
    in.position = {place(random), place(random), place(random)};
    const float v = value_of(p, in).x;
    low = std::min(low, v), high = std::max(high, v);
    in.position.x += 1e-3f;
    CHECK(std::abs(value_of(p, in).x - v) < 5e-3f);
  }
  CHECK(low >= 0.0f);
  CHECK(high <= 1.0f);
  CHECK(high - low > 0.5f);
}

// SPDX-License-Identifier: Apache-2.0
// Shading classes: every object finds one that has all it needs, plain objects are kept from dear ones.
#include <doctest/doctest.h>

#include "scene/shading_classes.h"
#include "shared/features.h"
#include "shared/material_program.h"

using namespace hw;

TEST_CASE("every feature set finds a class that holds it") {
  std::map<std::uint32_t, std::size_t> objects;
  std::uint32_t bits = 1;
  for (int i = 0; i < 200; ++i) {
    bits = bits * 1664525u + 1013904223u;
    objects[bits & 0x07ff1fffu] += i + 1;
  }
  const ShadingClasses classes = choose_shading_classes(objects);
  CHECK(classes.features.size() <= HW_MAX_SHADING_CLASSES);
  for (const auto& [features, count] : objects) {
    CHECK((features & ~classes.features.at(classes.class_of(features))) == 0);
    CHECK((features & ~classes.all) == 0);
  }
}

TEST_CASE("an object with noise does not burden plain ones") {
  const std::uint32_t plain = HW_FEATURE_GLOSSY | HW_VM_PRINCIPLED << HW_FEATURE_VM_SHIFT;
  const std::uint32_t noisy = plain | HW_VM_NOISE << HW_FEATURE_VM_SHIFT;
  const ShadingClasses classes = choose_shading_classes({{plain, 10}, {noisy, 1}});
  REQUIRE(classes.features.size() == 2);
  CHECK(classes.features[classes.class_of(plain)] == plain);
  CHECK(classes.features[classes.class_of(noisy)] == noisy);
}

TEST_CASE("alike objects share a class, and no objects are one empty class") {
  CHECK(choose_shading_classes({{HW_FEATURE_GLOSSY, 5}, {HW_FEATURE_GLOSSY | HW_FEATURE_BUMP, 5}}).features.size() ==
        1);
  CHECK(choose_shading_classes({}).features.size() == 1);
}

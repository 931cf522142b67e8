// SPDX-License-Identifier: Apache-2.0
// Materials: programs and constants of all of them one behind the other, with image operands made global. They are
// small, so any change writes all of them.
#include <algorithm>

#include "materials/program_check.h"
#include "scene/tables_impl.h"
#include "shared/material_program.h"

namespace hw {
namespace {

// What has no material: a diffuse surface of albedo 0.8, as Blender's default.
constexpr std::uint32_t kDefaultProgram[] = {
    HW_PROGRAM_MAGIC,
    1,
    0,
    0,
    HW_OP_DIFFUSE,
    HW_OPERAND_CONSTANT | (HW_OPERAND_CONSTANT | 1u) << 16,
    HW_REGISTER_NORMAL,
    HW_OPERAND_CONSTANT | 2u,
    HW_OP_END,
    0,
    0,
    0,
};
constexpr float kDefaultConstants[] = {0.8f, 0.8f, 0.8f, 0, 0, 0, 0, 0, 1, 1, 1, 0};

}  // namespace

MaterialData default_material() {
  MaterialData material;
  material.name = "default";
  material.program.assign(std::begin(kDefaultProgram), std::end(kDefaultProgram));
  material.constants.assign(std::begin(kDefaultConstants), std::end(kDefaultConstants));
  return material;
}

void Tables::update_materials(TableCounts& counts) {
  const Scene::Impl& scene = scene_.impl();
  totals_.materials = scene.materials.size();
  if (seen_materials_ == scene.materials_revision) return;

  const MaterialData fallback = default_material();
  std::vector<const MaterialData*> materials{&fallback};
  std::map<Id, std::uint32_t> index;
  std::size_t words = fallback.program.size(), constants = fallback.constants.size();
  for (const auto& [id, entry] : scene.materials) {
    index.emplace_hint(index.end(), id, static_cast<std::uint32_t>(materials.size()));
    materials.push_back(&entry.data);
    words += entry.data.program.size();
    constants += entry.data.constants.size();
  }
  // What instances take from materials: their indices, whether shadow rays pass and whether they emit, and (below) what
  // their programs need.
  constexpr std::uint32_t kInstanceFlags = HW_MATERIAL_TRANSPARENT | HW_MATERIAL_EMISSIVE | HW_MATERIAL_EMISSION_SHADER;
  bool instances_care = index != material_index_ || material_table_.size() != materials.size();
  for (std::size_t i = 0; i < materials.size() && !instances_care; ++i)
    instances_care = ((materials[i]->flags ^ material_table_[i].flags) & kInstanceFlags) != 0;
  material_index_ = std::move(index);
  layout_dirty_ |= instances_care;
  lights_layout_dirty_ = true;  // what its triangles emit may have changed

  if (words > HW_NONE || constants / 4 > HW_NONE) throw SceneError("the materials' programs are too large together");
  material_table_.resize(materials.size());
  program_table_.resize(words);
  constant_table_.resize(constants);
  std::uint32_t* program_out = program_table_.edit(0, words);
  float* constant_out = constant_table_.edit(0, constants);
  std::size_t word = 0, constant = 0;
  totals_.material_flags = 0;
  std::vector<std::uint32_t> features(materials.size());
  std::vector<std::uint32_t> program;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const MaterialData& material = *materials[i];
    MaterialRecord record{};
    record.program = static_cast<uint>(word);
    record.program_words = static_cast<uint>(material.program.size());
    record.constants = static_cast<uint>(constant / 4);
    const ProgramView view{material.program.data(), material.program.size(), material.constants.data(),
                           material.constants.size() / 4, material.images.size()};
    record.flags = material.flags | (program_depends_on_view(view) ? HW_MATERIAL_UNEVEN : 0u);
    record.emission = vec3(material.emission[0], material.emission[1], material.emission[2]);
    record.pass_index = material.pass_index;
    material_table_.set(i, record);
    program = material.program;
    patch_program_images(program.data(), program.size(), [&](std::uint32_t image) {
      const Id id = image < material.images.size() ? material.images[image] : 0;
      return id == 0 ? 0u : image_index_.at(id);
    });
    std::copy(program.begin(), program.end(), program_out + word);
    std::copy(material.constants.begin(), material.constants.end(), constant_out + constant);
    word += material.program.size();
    constant += material.constants.size();
    totals_.material_flags |= material.flags;
    features[i] = program_features(view);
  }
  layout_dirty_ |= features != material_features_;  // the classes that objects are shaded in
  material_features_ = std::move(features);
  counts.materials_uploaded += scene.materials.size();
  seen_materials_ = scene.materials_revision;
}

}  // namespace hw

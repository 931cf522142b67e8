// SPDX-License-Identifier: Apache-2.0
// The scene's tables on the device (shared/tables.h), kept in step with a Scene by uploading only what changed, and the
// geometry given to a Tracer.
//
// On a device that shares memory with the host a mesh's arrays and an image's texels live once: they are copied into
// the mapped buffer, the scene's own copy is released, and a host Tracer reads the buffer. The scene gets them back
// when the Tables are destroyed (see keep_scene()).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "lights/light_table.h"
#include "lights/light_tree.h"
#include "lights/world_distribution.h"
#include "scene/light_identity.h"
#include "scene/measured_emission.h"
#include "scene/scene.h"
#include "scene/shading_classes.h"
#include "scene/upload.h"
#include "shared/features.h"
#include "shared/light_kinds.h"
#include "shared/tables.h"
#include "trace/tracer.h"

namespace hw {

struct TableCounts {
  std::uint64_t meshes_uploaded = 0, instances_uploaded = 0, materials_uploaded = 0, images_uploaded = 0,
                lights_uploaded = 0;
  std::uint64_t bytes_uploaded = 0;
  double upload_seconds = 0, build_seconds = 0, lights_seconds = 0;
};

// What is in the tables now.
struct TableTotals {
  std::uint64_t meshes = 0, instances = 0, materials = 0, images = 0, lamps = 0, lights = 0;
  std::uint64_t triangles = 0;         // of all instances
  std::uint64_t unique_triangles = 0;  // of all meshes
  std::uint32_t material_flags = 0;    // HW_MATERIAL_* of all materials, or-ed
  ShadingClasses classes;              // HW_FEATURE_* that the programs of the instances' materials need
  bool smooth_normals = false;         // some mesh has normals
  bool texel_formats = false;          // some image is not HW_TEXEL_RGBA8
};

class Tables {
 public:
  // `device`, `scene` and `tracer` outlive the Tables.
  Tables(Device& device, Scene& scene, Tracer& tracer);
  ~Tables();

  // Brings tables and Tracer in line with the scene, after Scene::commit(). Not while rendering. Throws SceneError,
  // DeviceError (OutOfMemory) or what the Tracer throws; the next update() then goes over everything again.
  TableCounts update();

  // Gives the system back what updates freed: arrays that now lie in mapped buffers alone. Once, after the last of
  // several updates: pages given back between them are only faulted in again (measured: a third of the CPU time).
  void trim_heap();

  // How lights are chosen: "uniform" or "power" (odds of the alias table), or "tree", which builds the light tree
  // beside the table by power. Throws std::invalid_argument for another name.
  void choose_lights(const std::string& name);

  // The world's importance map is evaluated by a stage, since its background is a program. When this gives a size after
  // update(), evaluate the luminance of the grid (core/lights/light_table.h says where its texels lie) and pass it on.
  struct GridSize {
    std::uint32_t width = 0, height = 0;
  };
  std::optional<GridSize> world_luminance_wanted() const;
  void set_world_luminance(std::span<const float> luminance, std::uint32_t width, std::uint32_t height);

  // Emission that programs give over triangles is evaluated by a stage too, in up to two rounds. Where this gives a
  // grid after update(), pass on the mean radiance of each of its cells, in its order; and ask again.
  const EmissionGrid* emission_wanted() const;
  void set_emission(std::span<const float> radiance);

  // How the lights of the table differ from those at the last call of take_light_changes() (before the first: from no
  // lights), over all that came between: updates, the world's luminance, another way to choose lights. Places are those
  // of the table as it is now. `remap` counts the lights that cannot be chosen, also when Root::light_count is 0.
  const LightChanges& light_changes() const { return lights_->changes; }
  // Returns them and begins anew: call it when what was kept from earlier frames has been brought in line.
  LightChanges take_light_changes();

  // Addresses that the session owns.
  void set_luts(VkDeviceAddress address) { set_address(root_.luts, address); }

  // The buffer that holds the root, always the same one. Uploads pending changes of the root itself.
  const Buffer& root_buffer();
  const Root& root() const { return root_; }
  const TableTotals& totals() const { return totals_; }
  // Of a sphere about everything [m].
  float radius() const { return lights_->input_radius; }
  // Estimate of the flux of all lights together [W]: twice the emission gives twice of it.
  float light_power() const { return lights_->table.total_weight; }
  // HW_KIND_* that kernels of this scene need.
  std::uint32_t light_kinds() const {
    return lights_->table.kinds | ((totals_.material_flags & HW_MATERIAL_EMISSIVE) ? HW_KIND_EMISSION : 0u);
  }
  // Counts the light trees that were built: a refit one keeps its nodes' lights.
  std::uint64_t light_tree_revision() const { return lights_->tree_revision; }
  // Counts its builds and refits: bounds and power of its nodes are what they were.
  std::uint64_t light_tree_fit() const { return lights_->tree_fit; }
  // What a power of 1 of its nodes stands for [W sr^-1].
  float light_tree_unit() const { return lights_->tree.unit; }
  // HW_FEATURE_* that the world's program needs; 0 for a constant world.
  std::uint32_t world_features() const {
    return root_.world_material == HW_NONE ? 0 : material_features_[root_.world_material];
  }

  // Whether the Tracer still holds this scene: false before update(), and after other Tables have updated.
  bool current() const { return tracer_.owner == this && !failed_; }

  // When false, the destructor does not copy lent arrays back: for a scene that goes away as well.
  void keep_scene(bool keep) { keep_scene_ = keep; }

 private:
  friend struct TablesInspector;  // tests
  struct MeshSlot;
  struct ImageSlot;
  struct GroupSlot;
  struct LightState {
    std::vector<LightData> lamps;
    std::vector<std::pair<Id, std::uint32_t>> lamp_kinds;  // ids and types: when they differ, places in the table do
    WorldLight world;
    WorldTables distribution;
    std::optional<GridSize> wanted;
    std::uint64_t world_revision = 0;
    bool world_changed = false;  // the distribution is to be uploaded
    float input_radius = 0;
    LightSelection selection = LightSelection::kPower;
    LightTable table;
    bool wants_tree = false;
    bool tree_current = false;  // `tree` is of `table`
    LightTree tree;
    std::uint64_t tree_revision = 0, tree_fit = 0;
    LightSnapshot now, taken;  // of `table`, and as it was when changes were last taken
    bool noted = false;        // `now` is newer than `taken`
    std::uint64_t noted_images = 0;
    LightChanges changes;  // from `taken` to `now`
    std::map<EmissionKey, MeasuredEmission> emission;
    EmissionMeasuring measuring;
  };

  void set_address(std::uint64_t& where, VkDeviceAddress address) { root_dirty_ |= where != address, where = address; }
  void update_meshes(Uploader& uploader, TableCounts& counts);
  void upload_mesh(Id id, MeshSlot& slot, Uploader& uploader);
  void trace_mesh(Id id, MeshSlot& slot);
  void take_tracer();
  void leave_tracer();
  void update_images(Uploader& uploader, TableCounts& counts);
  void update_materials(TableCounts& counts);
  void update_instances(TableCounts& counts);
  void lay_out_instances();
  void write_group(GroupSlot& slot);
  void set_no_mesh();
  void feed_tracer_instances();
  void update_lights(Uploader& uploader, TableCounts& counts);
  void update_light_tree(bool rebuilt);
  void gather_lamps();
  void gather_world();
  void match_emission();
  void want_emission();
  void take_coarse(std::span<const float> values);
  void finish_emission();
  void gather_instances(std::vector<EmissiveInstance>& instances, std::vector<std::uint32_t>& moved) const;
  void note_lights(std::span<const EmissiveInstance> instances, bool rebuilt);
  void note_emitters(LightSnapshot& next, std::span<const EmissiveInstance> instances, bool rebuilt);
  float scene_radius() const;
  void relight();
  void update_root();
  void give_back(bool copy);

  Device& device_;
  Scene& scene_;
  Tracer& tracer_;
  bool keep_scene_ = true;
  bool failed_ = false;     // the last update did not finish
  bool untrimmed_ = false;  // updates freed arrays since the last trim_heap()

  std::map<Id, MeshSlot> meshes_;
  std::vector<std::uint32_t> free_mesh_records_;
  std::map<Id, ImageSlot> images_;
  std::map<Id, std::uint32_t> material_index_, image_index_;
  std::vector<std::uint32_t> material_features_;  // HW_FEATURE_* of each material in the table
  std::map<Id, GroupSlot> groups_;
  std::unique_ptr<LightState> lights_;

  Table<MeshRecord> mesh_table_;
  Table<InstanceRecord> instance_table_;
  Table<std::uint32_t> slot_table_;
  Table<MaterialRecord> material_table_;
  Table<std::uint32_t> program_table_;
  Table<float> constant_table_;
  Table<ImageRecord> image_table_;
  Table<LightRecord> light_table_;
  Table<AliasEntry> alias_table_;
  Table<LightTreeNode> light_tree_table_;
  Table<LightTreeBounds> light_leaf_table_;
  Table<std::uint32_t> light_order_table_, light_position_table_;
  Table<float> world_table_, emission_map_table_;
  std::unique_ptr<Buffer> root_buffer_;
  Root root_{};
  bool root_dirty_ = true;
  TableTotals totals_;

  // Revisions of the scene that the tables show.
  std::uint64_t seen_ = 0, seen_layout_ = 0, seen_lights_ = 0, seen_materials_ = 0, seen_images_ = 0;
  std::uint64_t array_bytes_ = 0;    // of mesh arrays and texels, by the update under way
  bool layout_dirty_ = true;         // slots or masks of instances must be worked out again
  bool lights_layout_dirty_ = true;  // lights came or went
  bool lights_dirty_ = true;         // lights changed in place
  bool tracer_instances_dirty_ = true;
  bool has_no_mesh_ = false;
};

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// Meshes and images: arrays that are copied to the device once and then only referred to.
#include <algorithm>
#include <cstring>

#include "scene/tables_impl.h"

namespace hw {
namespace {

// Embree reads vertices in steps of 16 bytes, past the last one.
constexpr std::size_t kTailBytes = 16;

// Places arrays one behind the other in one buffer, each at a multiple of 16 and padded to one, so that kernels may
// read whole 64-bit words (lib/words.glsl).
struct Layout {
  std::size_t bytes = 0;
  std::size_t add(std::size_t size) {
    const std::size_t at = bytes;
    bytes += (size + 15) / 16 * 16;
    return at;
  }
};

template <class T>
void forget(std::vector<T>& values) {
  std::vector<T>().swap(values);
}

template <class T>
std::span<const T> mapped_span(const Buffer& buffer, std::size_t offset, std::size_t count) {
  return {reinterpret_cast<const T*>(buffer.as<std::byte>() + offset), count};
}

}  // namespace

void Tables::upload_mesh(Id id, MeshSlot& slot, Uploader& uploader) {
  Scene::Impl& scene = scene_.impl();
  MeshEntry& entry = scene.meshes.at(id);
  const MeshArrays& from = entry.arrays;
  const MeshSummary& summary = entry.summary;
  const std::string label = "mesh " + entry.data.name;

  Layout layout;
  const std::size_t vertices_at = layout.add(from.tri_vertices.size_bytes());
  const std::size_t corners_at = layout.add(from.tri_corners.size_bytes());
  const std::size_t normals_at = layout.add(from.normals.size_bytes());
  const std::size_t slots_at = layout.add(from.tri_slots.size_bytes());
  std::vector<std::size_t> attributes_at;
  for (const auto& attribute : from.attributes) attributes_at.push_back(layout.add(attribute.size_bytes()));

  auto positions = std::make_unique<Buffer>(device_, from.positions.size_bytes() + kTailBytes, BufferUse::device,
                                            label + ", positions");
  auto arrays = std::make_unique<Buffer>(device_, layout.bytes, BufferUse::device, label);
  uploader.write(*positions, 0, std::as_bytes(from.positions));
  uploader.write(*arrays, vertices_at, std::as_bytes(from.tri_vertices));
  uploader.write(*arrays, corners_at, std::as_bytes(from.tri_corners));
  uploader.write(*arrays, normals_at, std::as_bytes(from.normals));
  uploader.write(*arrays, slots_at, std::as_bytes(from.tri_slots));
  for (std::size_t i = 0; i < from.attributes.size(); ++i)
    uploader.write(*arrays, attributes_at[i], std::as_bytes(from.attributes[i]));

  // The positions it had become last frame's, unless nothing moved (on a device with its own memory there is nothing
  // left to compare with: then they count as moved).
  std::unique_ptr<Buffer> last;
  // Set before the last frame, it has stood still since.
  const bool deformed = slot.positions && entry.set_frame + 1 == scene.frame &&
                        slot.vertex_count == summary.vertex_count && summary.vertex_count > 0 &&
                        !(positions->mapped() &&
                          std::memcmp(positions->mapped(), slot.positions->mapped(), from.positions.size_bytes()) == 0);

  MeshRecord record{};
  record.positions = positions->address();
  record.tri_vertices = arrays->address() + vertices_at;
  if (summary.corners_in_order)
    record.tri_corners = HW_CORNERS_IN_ORDER;
  else if (!from.tri_corners.empty())
    record.tri_corners = arrays->address() + corners_at;
  if (!from.normals.empty()) record.normals = arrays->address() + normals_at;
  if (!from.tri_slots.empty()) record.tri_slots = arrays->address() + slots_at;
  if (deformed) record.motion = slot.positions->address();
  record.vertex_count = summary.vertex_count;
  record.triangle_count = summary.triangle_count;
  record.attribute_count = static_cast<uint>(from.attributes.size());
  record.default_uv = entry.data.default_uv;
  for (std::size_t i = 0; i < from.attributes.size(); ++i) {
    const AttributeData& attribute = entry.data.attributes[i];
    record.attributes[i] = {arrays->address() + attributes_at[i], attribute_hash(attribute.name), attribute.domain,
                            attribute.components, 0};
  }

  if (positions->mapped() && entry.lender == nullptr) {
    // From here on the mapped buffers are the scene's only copy.
    MeshArrays lent;
    lent.positions = mapped_span<float>(*positions, 0, from.positions.size());
    lent.tri_vertices = mapped_span<std::uint32_t>(*arrays, vertices_at, from.tri_vertices.size());
    lent.tri_corners = mapped_span<std::uint32_t>(*arrays, corners_at, from.tri_corners.size());
    lent.normals = mapped_span<float>(*arrays, normals_at, from.normals.size());
    lent.tri_slots = mapped_span<std::uint8_t>(*arrays, slots_at, from.tri_slots.size());
    for (std::size_t i = 0; i < from.attributes.size(); ++i)
      lent.attributes.push_back(mapped_span<float>(*arrays, attributes_at[i], from.attributes[i].size()));
    entry.arrays = std::move(lent);
    entry.lender = this;
    forget(entry.data.positions), forget(entry.data.normals), forget(entry.data.tri_vertices);
    forget(entry.data.tri_corners), forget(entry.data.tri_slots);
    for (AttributeData& attribute : entry.data.attributes) forget(attribute.data);
    if (entry.data.keeper) scene.done_keepers.push_back(std::move(entry.data.keeper));
  }

  // The old buffers stay until the Tracer has let go of them.
  const std::unique_ptr<Buffer> old_arrays = std::move(slot.arrays);
  const std::unique_ptr<Buffer> old_motion = std::move(slot.motion);
  if (!deformed) last = std::move(slot.positions);
  slot.motion = deformed ? std::move(slot.positions) : nullptr;
  slot.motion_frame = scene.frame;
  slot.positions = std::move(positions);
  slot.arrays = std::move(arrays);
  slot.tri_vertices_at = vertices_at;
  slot.vertex_count = summary.vertex_count;
  slot.revision = entry.revision;
  slot.changed = true;
  mesh_table_.set(slot.record, record);
  array_bytes_ += slot.positions->bytes() - kTailBytes + layout.bytes;
  trace_mesh(id, slot);
}

// Gives the mesh to the Tracer, in its mapped buffers where it has some.
void Tables::trace_mesh(Id id, MeshSlot& slot) {
  const MeshEntry& entry = scene_.impl().meshes.at(id);
  if (entry.summary.triangle_count == 0) {
    if (slot.traced) tracer_.remove_mesh(id);
    slot.traced = false;
    return;
  }
  TraceMesh trace{entry.arrays.positions, entry.arrays.tri_vertices, entry.data.name};
  if (slot.positions->mapped()) {
    trace.positions = mapped_span<float>(*slot.positions, 0, trace.positions.size());
    trace.indices = mapped_span<std::uint32_t>(*slot.arrays, slot.tri_vertices_at, trace.indices.size());
    trace.padded = true;
  }
  try {
    slot.traced = true;
    tracer_.set_mesh(id, trace);
  } catch (...) {
    slot.revision = 0;  // the next update tries again
    throw;
  }
}

// The Tracer holds one scene at a time: another Tables' geometry goes out first, and ours goes in again.
void Tables::take_tracer() {
  if (tracer_.owner == this) return;
  if (tracer_.evict_owner) tracer_.evict_owner();
  tracer_.owner = this;
  tracer_.evict_owner = [this] { leave_tracer(); };
  for (auto& [id, slot] : meshes_) {
    const auto entry = scene_.impl().meshes.find(id);
    // Those that changed are given to the Tracer when they are uploaded.
    if (!slot.traced && entry != scene_.impl().meshes.end() && entry->second.revision == slot.revision)
      trace_mesh(id, slot);
  }
  tracer_.set_lamps(lights_->table.shapes);
  tracer_instances_dirty_ = true;
}

void Tables::leave_tracer() {
  tracer_.set_instances({});
  tracer_.set_lamps({});
  for (auto& [id, slot] : meshes_) {
    if (slot.traced) tracer_.remove_mesh(id);
    slot.traced = false;
  }
  if (has_no_mesh_) tracer_.remove_mesh(kNoMesh);
  has_no_mesh_ = false;
  tracer_.owner = nullptr;
  tracer_.evict_owner = nullptr;
}

void Tables::update_meshes(Uploader& uploader, TableCounts& counts) {
  const Scene::Impl& scene = scene_.impl();
  for (auto it = meshes_.begin(); it != meshes_.end();) {
    MeshSlot& slot = it->second;
    slot.changed = false;
    if (scene.meshes.contains(it->first)) {
      ++it;
      continue;
    }
    if (slot.traced) tracer_.remove_mesh(it->first);
    mesh_table_.set(slot.record, MeshRecord{});
    free_mesh_records_.push_back(slot.record);
    it = meshes_.erase(it);
  }
  totals_.meshes = scene.meshes.size();
  totals_.unique_triangles = 0;
  totals_.smooth_normals = false;
  for (const auto& [id, entry] : scene.meshes) {
    totals_.unique_triangles += entry.summary.triangle_count;
    MeshSlot& slot = meshes_[id];
    if (slot.record == HW_NONE) {
      if (free_mesh_records_.empty()) {
        slot.record = static_cast<std::uint32_t>(mesh_table_.size());
        mesh_table_.resize(slot.record + 1);
        mesh_table_.set(slot.record, MeshRecord{});
      } else {
        slot.record = free_mesh_records_.back();
        free_mesh_records_.pop_back();
      }
    }
    if (slot.revision != entry.revision) {
      upload_mesh(id, slot, uploader);
      ++counts.meshes_uploaded;
    } else if (slot.motion && slot.motion_frame != scene.frame) {
      // It was not set again: it stands still now.
      mesh_table_.edit(slot.record, 1)->motion = 0;
      slot.motion.reset();
    }
    totals_.smooth_normals |= !entry.arrays.normals.empty();
  }
}

void Tables::update_images(Uploader& uploader, TableCounts& counts) {
  Scene::Impl& scene = scene_.impl();
  totals_.images = scene.images.size();
  if (seen_images_ == scene.images_revision) return;
  std::erase_if(images_, [&](const auto& item) { return !scene.images.contains(item.first); });
  const std::map<Id, std::uint32_t> before = std::move(image_index_);
  image_index_.clear();
  image_table_.resize(scene.images.size() + 1);
  image_table_.set(0, ImageRecord{});  // a missing image
  totals_.texel_formats = false;
  std::uint32_t index = 1;
  for (auto& [id, entry] : scene.images) {
    ImageSlot& slot = images_[id];
    const ImageData& image = entry.data;
    if (slot.revision != entry.revision) {
      slot.texels.reset();
      auto texels =
          std::make_unique<Buffer>(device_, entry.texels.size() + kTailBytes, BufferUse::device, "image " + image.name);
      uploader.write(*texels, 0, std::as_bytes(entry.texels));
      if (texels->mapped() && entry.lender == nullptr) {
        entry.texels = mapped_span<std::uint8_t>(*texels, 0, entry.texels.size());
        entry.lender = this;
        forget(entry.data.texels);
        if (entry.data.keeper) scene.done_keepers.push_back(std::move(entry.data.keeper));
      }
      slot.texels = std::move(texels);
      array_bytes_ += slot.texels->bytes() - kTailBytes;
      slot.revision = entry.revision;
      ++counts.images_uploaded;
    }
    totals_.texel_formats |= image.format != HW_TEXEL_RGBA8;
    image_table_.set(index, {slot.texels->address(), image.width, image.height, image.format, image.flags});
    image_index_[id] = index++;
  }
  seen_images_ = scene.images_revision;
  if (before != image_index_) seen_materials_ = 0;  // programs hold the indices
}

// Ends the loan of the scene's arrays: they are copied back, or else the scene's views are only cleared. Each buffer
// goes as soon as its contents are back, so that memory holds at most one mesh twice.
void Tables::give_back(bool keep) {
  const auto copy = [&](auto& to, const auto& from) { keep ? to.assign(from.begin(), from.end()) : to.clear(); };
  for (auto& [id, entry] : scene_.impl().meshes) {
    if (entry.lender != this) continue;
    MeshData& data = entry.data;
    MeshArrays& arrays = entry.arrays;
    copy(data.positions, arrays.positions), copy(data.normals, arrays.normals);
    copy(data.tri_vertices, arrays.tri_vertices), copy(data.tri_corners, arrays.tri_corners);
    copy(data.tri_slots, arrays.tri_slots);
    for (std::size_t i = 0; i < data.attributes.size(); ++i) copy(data.attributes[i].data, arrays.attributes[i]);
    arrays = mesh_views(data);
    entry.lender = nullptr;
    meshes_.erase(id);
  }
  for (auto& [id, entry] : scene_.impl().images) {
    if (entry.lender != this) continue;
    copy(entry.data.texels, entry.texels);
    entry.texels = entry.data.texels;
    entry.lender = nullptr;
    images_.erase(id);
  }
}

}  // namespace hw

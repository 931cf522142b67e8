// SPDX-License-Identifier: Apache-2.0
// Checks at the scene's boundary; the policy for bad numbers is in validate.h.
#include "scene/validate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "materials/program_check.h"

namespace hw {
namespace {

constexpr std::size_t kMaxElements = 0x7fffffff;  // shaders index with 32 bits and some drivers treat them as signed
constexpr std::uint32_t kMaxImageSide = 1u << 16;
constexpr std::size_t kMaxTexels = std::size_t{1} << 30;
constexpr float kPi = 3.14159265f;

[[noreturn]] void fail(const std::string& label, const std::string& reason) { throw SceneError(label + ": " + reason); }

// Position of the first value that is not finite; `count` when there is none.
std::size_t first_not_finite(const float* values, std::size_t count) {
  // Blocks without an early exit inside, so that the compiler can use vectors.
  constexpr std::size_t kBlock = 4096;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(count, begin + kBlock);
    std::uint32_t bad = 0;
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t bits;
      std::memcpy(&bits, values + i, 4);
      bad |= (bits & 0x7f800000u) == 0x7f800000u ? 1u : 0u;
    }
    if (!bad) continue;
    for (std::size_t i = begin; i < end; ++i)
      if (!std::isfinite(values[i])) return i;
  }
  return count;
}

std::uint32_t largest(std::span<const std::uint32_t> values) {
  std::uint32_t result = 0;
  for (std::uint32_t v : values) result = std::max(result, v);
  return result;
}

std::string number(double value) {
  std::string text = std::to_string(value);
  while (text.find('.') != std::string::npos && (text.back() == '0' || text.back() == '.')) {
    const bool point = text.back() == '.';
    text.pop_back();
    if (point) break;
  }
  return text;
}

void require_finite(const std::string& label, const float* values, std::size_t count, const char* what) {
  const std::size_t bad = first_not_finite(values, count);
  if (bad != count)
    fail(label, std::string(what) + " holds a number that is not finite (at " + std::to_string(bad) + ")");
}

void require_range(const std::string& label, float value, float low, float high, const char* what) {
  if (!(value >= low && value <= high))
    fail(label, std::string(what) + " is " + number(value) + ", outside " + number(low) + " to " + number(high));
}

void require_not_negative(const std::string& label, float value, const char* what) {
  if (!(value >= 0) || !std::isfinite(value))
    fail(label, std::string(what) + " is " + number(value) + ": it must be 0 or more");
}

// The elements of an array, to be changed: in the vector `own`, which it is copied to unless it is there already.
float* editable(std::span<const float>& array, std::vector<float>& own) {
  if (array.data() != own.data()) own.assign(array.begin(), array.end());
  array = own;
  return own.data();
}

// Whether the array is 0, 1, 2, ... and not empty.
bool in_order(std::span<const std::uint32_t> values) {
  // Blocks without an early exit inside, as above.
  constexpr std::size_t kBlock = 1024;
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    std::uint32_t other = 0;
    for (std::size_t i = begin; i < std::min(values.size(), begin + kBlock); ++i)
      other |= values[i] ^ static_cast<std::uint32_t>(i);
    if (other) return false;
  }
  return !values.empty();
}

// Corners whose normal can't be used get the geometric normal of a triangle that has them.
void repair_normals(MeshArrays& mesh, std::vector<float>& own) {
  const float* given = mesh.normals.data();
  const std::size_t count = mesh.normals.size() / 3;
  const auto unusable = [&](std::size_t c) {
    const float x = given[3 * c], y = given[3 * c + 1], z = given[3 * c + 2];
    const float square = x * x + y * y + z * z;
    return !(square > 1e-20f && square <= std::numeric_limits<float>::max());
  };
  std::uint32_t any = 0;  // not a bool, whose loop would have an early exit
  for (std::size_t c = 0; c < count; ++c) any |= unusable(c) ? 1u : 0u;
  if (!any) return;
  float* normals = editable(mesh.normals, own);
  given = normals;
  const std::span<const std::uint32_t> corners = mesh.tri_corners.empty() ? mesh.tri_vertices : mesh.tri_corners;
  for (std::size_t t = 0; t < mesh.tri_vertices.size() / 3; ++t) {
    double p[3][3];
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) p[k][a] = mesh.positions[3 * std::size_t{mesh.tri_vertices[3 * t + k]} + a];
    double n[3], length = 0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      n[a] = (p[1][b] - p[0][b]) * (p[2][c] - p[0][c]) - (p[1][c] - p[0][c]) * (p[2][b] - p[0][b]);
      length += n[a] * n[a];
    }
    length = std::sqrt(length);
    if (!(length > 0)) continue;
    for (int k = 0; k < 3; ++k)
      if (const std::size_t c = corners[3 * t + k]; unusable(c))
        for (int a = 0; a < 3; ++a) normals[3 * c + a] = static_cast<float>(n[a] / length);
  }
  for (std::size_t c = 0; c < count; ++c)  // corners of zero-area triangles only, or of none: any unit vector will do
    if (unusable(c)) normals[3 * c] = normals[3 * c + 1] = 0, normals[3 * c + 2] = 1;
}

void check_attribute_names(const std::string& label, const MeshData& mesh) {
  const std::size_t count = mesh.attributes.size() + mesh.tangents.size();
  if (count > HW_MAX_ATTRIBUTES)
    fail(label, std::to_string(count) + " attributes; at most " + std::to_string(HW_MAX_ATTRIBUTES) + " are kept");
  std::vector<std::uint32_t> hashes;
  const auto check = [&](const std::string& name) {
    if (name.empty()) fail(label, "an attribute has no name");
    const std::uint32_t hash = attribute_hash(name);
    if (std::find(hashes.begin(), hashes.end(), hash) != hashes.end())
      fail(label, "attribute \"" + name + "\" is given twice");
    hashes.push_back(hash);
  };
  for (const AttributeData& attribute : mesh.attributes) check(attribute.name);
  for (const TangentRequest& tangents : mesh.tangents) check(tangents.name);
}

void check_attributes(const std::string& label, MeshData& mesh, MeshArrays& arrays, std::size_t vertices,
                      std::size_t triangles, std::size_t corners) {
  check_attribute_names(label, mesh);
  for (std::size_t i = 0; i < mesh.attributes.size(); ++i) {
    AttributeData& attribute = mesh.attributes[i];
    std::span<const float>& values = arrays.attributes[i];
    const std::string what = "attribute \"" + attribute.name + "\"";
    if (attribute.components < 1 || attribute.components > 4)
      fail(label, what + " has " + std::to_string(attribute.components) + " components: 1 to 4 are allowed");
    if (values.size() % attribute.components != 0) fail(label, what + " holds a part of an element");
    const std::size_t count = values.size() / attribute.components;
    if (attribute.domain == HW_DOMAIN_VERTEX) {
      if (count != vertices)
        fail(label, what + " has " + std::to_string(count) + " elements for " + std::to_string(vertices) + " vertices");
    } else if (attribute.domain == HW_DOMAIN_FACE) {
      if (count != triangles)
        fail(label,
             what + " has " + std::to_string(count) + " elements for " + std::to_string(triangles) + " triangles");
    } else if (attribute.domain == HW_DOMAIN_CORNER) {
      if (count < corners)
        fail(label, what + " has " + std::to_string(count) + " elements for " + std::to_string(corners) + " corners");
    } else {
      fail(label, what + " has an unknown domain (" + std::to_string(attribute.domain) + ")");
    }
    for (std::size_t at = 0; (at += first_not_finite(values.data() + at, values.size() - at)) < values.size();)
      editable(values, attribute.data)[at] = 0;
  }
  if (mesh.default_uv < -1 || mesh.default_uv >= static_cast<int>(mesh.attributes.size()))
    fail(label, "default_uv is " + std::to_string(mesh.default_uv) + ": there are " +
                    std::to_string(mesh.attributes.size()) + " attributes");
  if (mesh.default_uv >= 0 && mesh.attributes[static_cast<std::size_t>(mesh.default_uv)].components < 2)
    fail(label, "default_uv names an attribute with one component");
}

// Whether the tangents that the mesh asks for can be made. Corners are counted by the highest one that a triangle
// names: where no array has as many, it says nothing about the memory that they may take.
void check_tangents(const std::string& label, const MeshData& mesh, const MeshArrays& arrays, std::size_t corners) {
  std::size_t backed = std::max(arrays.tri_vertices.size(), arrays.positions.size() / 3);
  backed = std::max(backed, arrays.normals.size() / 3);
  for (std::size_t i = 0; i < mesh.attributes.size(); ++i)
    if (mesh.attributes[i].domain == HW_DOMAIN_CORNER)
      backed = std::max(backed, arrays.attributes[i].size() / mesh.attributes[i].components);
  for (const TangentRequest& tangents : mesh.tangents) {
    const std::string what = "tangents \"" + tangents.name + "\"";
    if (tangents.uv >= mesh.attributes.size())
      fail(label, what + " are of attribute " + std::to_string(tangents.uv) + ": there are " +
                      std::to_string(mesh.attributes.size()));
    const AttributeData& uv = mesh.attributes[tangents.uv];
    if (uv.components < 2 || uv.domain == HW_DOMAIN_FACE)
      fail(label, what + " are of attribute \"" + uv.name + "\", which is no UV map");
    if (corners > backed)
      fail(label, what + ": a triangle names corner " + std::to_string(corners - 1) + ", which no array has");
    if (corners > kMaxElements / 4) fail(label, what + ": too many corners (2^31 numbers at most)");
  }
}

// An attribute without values for each of the tangents, behind the others.
void add_tangents(MeshData& mesh, MeshArrays& arrays) {
  for (const TangentRequest& tangents : mesh.tangents) {
    mesh.attributes.push_back({tangents.name, HW_DOMAIN_CORNER, 4, {}});
    arrays.attributes.emplace_back();
  }
}

}  // namespace

std::string scene_label(const char* kind, const std::string& name, Id id) {
  return std::string(kind) + (name.empty() ? "" : " \"" + name + "\"") + " (id " + std::to_string(id) + ")";
}

bool all_finite(const float* values, std::size_t count) { return first_not_finite(values, count) == count; }

std::size_t texel_bytes(std::uint32_t format) {
  switch (format) {
    case HW_TEXEL_RGBA8:
      return 4;
    case HW_TEXEL_RGBA16F:
      return 8;
    case HW_TEXEL_RGBA32F:
      return 16;
    case HW_TEXEL_R8:
      return 1;
    default:
      return 0;
  }
}

MeshSummary check_mesh(Id id, MeshData& mesh, MeshArrays& arrays) {
  const std::string label = scene_label("mesh", mesh.name, id);
  if (id == ~Id{0}) fail(label, "this id is reserved");
  if (arrays.positions.size() % 3 != 0) fail(label, "positions are not three numbers a vertex");
  if (arrays.tri_vertices.size() % 3 != 0) fail(label, "tri_vertices are not three indices a triangle");
  const std::size_t vertices = arrays.positions.size() / 3, triangles = arrays.tri_vertices.size() / 3;
  if (arrays.tri_vertices.size() > kMaxElements || arrays.positions.size() > kMaxElements)
    fail(label, "too large: " + std::to_string(vertices) + " vertices, " + std::to_string(triangles) +
                    " triangles (2^31 numbers at most)");
  if (const std::size_t bad = first_not_finite(arrays.positions.data(), arrays.positions.size());
      bad != arrays.positions.size())
    fail(label, "the position of vertex " + std::to_string(bad / 3) + " is not finite");
  if (triangles > 0 && largest(arrays.tri_vertices) >= vertices)
    fail(label,
         "a triangle names vertex " + std::to_string(largest(arrays.tri_vertices)) + " of " + std::to_string(vertices));

  std::size_t corners = vertices;
  if (!arrays.tri_corners.empty()) {
    if (arrays.tri_corners.size() != arrays.tri_vertices.size())
      fail(label, "tri_corners has " + std::to_string(arrays.tri_corners.size() / 3) + " triangles, tri_vertices " +
                      std::to_string(triangles));
    const std::uint32_t last = largest(arrays.tri_corners);
    if (last >= kMaxElements) fail(label, "a triangle names corner " + std::to_string(last) + ": past 2^31");
    corners = std::size_t{last} + 1;
  }
  if (!arrays.normals.empty()) {
    if (arrays.normals.size() % 3 != 0) fail(label, "normals are not three numbers a corner");
    if (arrays.normals.size() / 3 < corners)
      fail(label, std::to_string(arrays.normals.size() / 3) + " normals for " + std::to_string(corners) + " corners");
    if (arrays.normals.size() > kMaxElements) fail(label, "too many normals");
    repair_normals(arrays, mesh.normals);
  }
  if (!arrays.tri_slots.empty() && arrays.tri_slots.size() != triangles)
    fail(label, "tri_slots has " + std::to_string(arrays.tri_slots.size()) + " entries for " +
                    std::to_string(triangles) + " triangles");
  check_attributes(label, mesh, arrays, vertices, triangles, corners);
  check_tangents(label, mesh, arrays, corners);
  add_tangents(mesh, arrays);

  MeshSummary summary;
  summary.corner_count = corners;
  summary.corners_in_order = in_order(arrays.tri_corners);
  if (summary.corners_in_order) {
    arrays.tri_corners = {};
    std::vector<std::uint32_t>().swap(mesh.tri_corners);
  }
  summary.vertex_count = static_cast<std::uint32_t>(vertices);
  summary.triangle_count = static_cast<std::uint32_t>(triangles);
  for (std::uint8_t slot : arrays.tri_slots) summary.max_slot = std::max<std::uint32_t>(summary.max_slot, slot);
  for (std::size_t v = 0; v < vertices; ++v)
    for (std::size_t a = 0; a < 3; ++a) {
      const float x = arrays.positions[3 * v + a];
      summary.min[a] = v == 0 ? x : std::min(summary.min[a], x);
      summary.max[a] = v == 0 ? x : std::max(summary.max[a], x);
    }
  return summary;
}

void check_instance(Id id, const InstanceData& instance, const float* matrices, std::size_t count) {
  const std::size_t bad = first_not_finite(matrices, 12 * count);
  if (bad != 12 * count)
    fail(scene_label("instance", instance.name, id + bad / 12), "its matrix holds a number that is not finite");
  const std::string label = scene_label("instance", instance.name, id);
  require_finite(label, instance.color.data(), 3, "color");
  require_range(label, instance.shadow_terminator_offset, 0, 1, "shadow_terminator_offset");
  constexpr std::uint32_t kVisibility = HW_MASK_CAMERA | HW_MASK_DIFFUSE | HW_MASK_GLOSSY | HW_MASK_TRANSMISSION |
                                        HW_MASK_SHADOW_OPAQUE | HW_MASK_SHADOW_TRANSPARENT | HW_MASK_VOLUME;
  if (instance.visibility & ~kVisibility)
    fail(label, "visibility has unknown bits (" + std::to_string(instance.visibility) + ")");
  if (instance.materials.size() > 256)
    fail(label, std::to_string(instance.materials.size()) + " material slots: at most 256");
}

void check_lights(std::span<const Id> ids, const LightData& light, const float* matrices) {
  const std::string label = scene_label("light", light.name, ids.front());
  if (light.type > HW_LIGHT_AREA) fail(label, "unknown kind of light (" + std::to_string(light.type) + ")");
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (const float* matrix = matrices + 12 * i; !all_finite(matrix, 12))
      require_finite(scene_label("light", light.name, ids[i]), matrix, 12, "its matrix");
  require_finite(label, light.color.data(), 3, "color");
  if (!std::isfinite(light.power)) fail(label, "power is not finite");
  require_not_negative(label, light.radius, "radius");
  require_range(label, light.angle, 0, kPi * 1.0001f, "angle");
  require_not_negative(label, light.size_x, "size_x");
  require_not_negative(label, light.size_y, "size_y");
  require_range(label, light.spread, 0, kPi * 1.0001f, "spread");
  require_range(label, light.spot_size, 0, kPi * 1.0001f, "spot_size");
  require_range(label, light.spot_blend, 0, 1, "spot_blend");
}

void check_material(Id id, const MaterialData& material) {
  const std::string label = scene_label("material", material.name, id);
  if (id == 0) fail(label, "id 0 is the built-in default material");
  require_finite(label, material.emission.data(), 3, "emission");
  if (material.constants.size() % 4 != 0) fail(label, "constants are not four numbers each");
  if (material.program.size() > kMaxElements || material.constants.size() > kMaxElements)
    fail(label, "the program is too large");
  const std::string wrong = check_program({material.program.data(), material.program.size(), material.constants.data(),
                                           material.constants.size() / 4, material.images.size()});
  if (!wrong.empty()) fail(label, "its program can't be used: " + wrong);
}

void check_image(Id id, const ImageData& image) {
  const std::string label = scene_label("image", image.name, id);
  if (id == 0) fail(label, "id 0 stands for a missing image");
  const std::size_t bytes = texel_bytes(image.format);
  if (bytes == 0) fail(label, "unknown texel format (" + std::to_string(image.format) + ")");
  if (image.flags & ~(HW_IMAGE_SRGB | HW_IMAGE_PREMULTIPLIED))
    fail(label, "unknown flags (" + std::to_string(image.flags) + ")");
  const std::string size = std::to_string(image.width) + " x " + std::to_string(image.height);
  if ((image.width == 0) != (image.height == 0)) fail(label, "its size is " + size);
  if (image.width > kMaxImageSide || image.height > kMaxImageSide ||
      std::size_t{image.width} * image.height > kMaxTexels)
    fail(label, size + " is too large: at most 65536 pixels a side and 2^30 in all");
  const std::size_t expected = std::size_t{image.width} * image.height * bytes;
  const std::size_t given = image.keeper ? image.lent.size() : image.texels.size();
  if (given != expected)
    fail(label, std::to_string(given) + " bytes for " + size + " pixels: " + std::to_string(expected) + " are needed");
}

void check_world(const WorldData& world) {
  const std::string label = "world \"" + world.name + "\"";
  require_finite(label, world.color.data(), 3, "color");
  if (world.importance_width > 16384)
    fail(label, "importance_width is " + std::to_string(world.importance_width) + ": at most 16384");
}

void check_panorama(const std::string& label, const CameraData& camera) {
  if (camera.panorama >= HW_PANORAMA_KINDS)
    fail(label, "unknown kind of panorama (" + std::to_string(camera.panorama) + ")");
  const float* range = camera.panorama_range;
  require_finite(label, range, 4, "the panorama's range");
  const bool fisheye = camera.panorama == HW_PANORAMA_FISHEYE_EQUIDISTANT;
  const bool equisolid = camera.panorama == HW_PANORAMA_FISHEYE_EQUISOLID;
  const bool polynomial = camera.panorama == HW_PANORAMA_FISHEYE_POLYNOMIAL;
  const bool ranges = camera.panorama == HW_PANORAMA_EQUIRECTANGULAR || camera.panorama == HW_PANORAMA_CYLINDRICAL;
  if (fisheye && !(range[0] > 0)) fail(label, "the fisheye's field of view must be above 0");
  if (equisolid && !(range[0] > 0 && range[1] > 0 && range[2] > 0 && range[3] > 0))
    fail(label, "the fisheye's lens, field of view and sensor must be above 0");
  if (polynomial) {
    const float* lens = camera.panorama_lens;
    require_finite(label, lens, 4, "the fisheye's polynomial");
    if (!(range[0] > 0 && range[2] > 0 && range[3] > 0))
      fail(label, "the fisheye's field of view and sensor must be above 0");
    if (std::all_of(lens, lens + 4, [](float k) { return k == 0; }))
      fail(label, "the fisheye's polynomial is constant");
  }
  if (ranges && !(range[1] > range[0] && range[3] > range[2])) fail(label, "the panorama's range is empty");
}

void check_camera(const CameraData& camera) {
  const std::string label = "camera";
  if (camera.type > HW_CAMERA_PANORAMIC) fail(label, "unknown kind of camera (" + std::to_string(camera.type) + ")");
  require_finite(label, camera.camera_to_world, 12, "its matrix");
  const float plane[4] = {camera.left, camera.right, camera.bottom, camera.top};
  require_finite(label, plane, 4, "the picture plane");
  if (!(camera.right > camera.left) || !(camera.top > camera.bottom)) fail(label, "the picture plane has no area");
  if (camera.type == HW_CAMERA_PANORAMIC) check_panorama(label, camera);
  float inverse[12];
  if (!invert(camera.camera_to_world, inverse)) fail(label, "its matrix can't be inverted");
  require_not_negative(label, camera.clip_start, "clip_start");
  if (!(camera.clip_end > camera.clip_start))
    fail(label,
         "clip_end (" + number(camera.clip_end) + ") must lie beyond clip_start (" + number(camera.clip_start) + ")");
  require_not_negative(label, camera.aperture_radius, "aperture_radius");
  if (camera.aperture_radius > 0 && !(camera.focus_distance > 0 && std::isfinite(camera.focus_distance)))
    fail(label, "focus_distance is " + number(camera.focus_distance) + ": it must be above 0");
  if (!std::isfinite(camera.aperture_rotation)) fail(label, "aperture_rotation is not finite");
  if (!(camera.aperture_ratio > 0 && std::isfinite(camera.aperture_ratio)))
    fail(label, "aperture_ratio must be above 0");
}

}  // namespace hw

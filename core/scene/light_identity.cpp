// SPDX-License-Identifier: Apache-2.0
// Two tables of lights side by side: both are in the order of ids, so one walk finds which lights are in both.
#include "scene/light_identity.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>

namespace hw {
namespace {

// Growth below these is rounding. Areas of triangles far from the origin are the least exact: their world positions
// round before edges are taken.
constexpr float kLampRounding = 1e-5f, kTriangleRounding = 1e-3f;

bool grew(float now, float before, float rounding = kLampRounding) { return now > before * (1 + rounding); }

bool grew(vec3 now, vec3 before) { return grew(now.x, before.x) || grew(now.y, before.y) || grew(now.z, before.z); }

// More kinds of rays see it, it emits from both sides, or nothing shadows it any more.
bool opened(std::uint32_t now, std::uint32_t before) {
  constexpr std::uint32_t kSeen =
      HW_LIGHT_CAMERA | HW_LIGHT_DIFFUSE | HW_LIGHT_GLOSSY | HW_LIGHT_TRANSMISSION | HW_LIGHT_TWO_SIDED;
  return (now & ~before & kSeen) != 0 || (before & ~now & HW_LIGHT_CAST_SHADOW) != 0;
}

class Comparison {
 public:
  Comparison(const LightSnapshot& before, const LightSnapshot& now) : before_(before), now_(now) {}

  LightChanges run() {
    lamps();
    world();
    emitters();
    std::size_t kept = 0;
    bool moved = false;
    for (const Block& block : blocks_) kept += block.count, moved |= block.from != block.to;
    if (kept != before_.count) changes_.changed = true;  // some are gone
    if (moved || kept != before_.count) {
      changes_.remap.assign(before_.count, HW_NONE);
      for (const Block& block : blocks_) {
        const auto at = changes_.remap.begin() + block.from;
        std::iota(at, at + block.count, block.to);
      }
    }
    changes_.changed |= changes_.brightened;
    return std::move(changes_);
  }

 private:
  using Lamp = LightSnapshot::Lamp;
  using Slot = LightSnapshot::Slot;
  using Emitters = LightSnapshot::Emitters;
  struct Block {  // lights that stand one behind the other in both tables
    std::uint32_t from, to, count;
  };

  void lamps() {
    auto old = before_.lamps.begin();
    for (const Lamp& lamp : now_.lamps) {
      while (old != before_.lamps.end() && old->id < lamp.id) ++old;
      if (old != before_.lamps.end() && old->id == lamp.id && old->record.type == lamp.record.type) {
        blocks_.push_back({old->index, lamp.index, 1});
        compare(*old, lamp);
      } else {
        changes_.changed = true;
        changes_.brightened |= lamp.flux > 0;
      }
    }
  }

  void compare(const Lamp& before, const Lamp& now) {
    LightRecord a = before.record, b = now.record;
    a.primitive = b.primitive = 0;  // its place
    if (std::memcmp(&a, &b, sizeof(LightRecord)) == 0) return;
    changes_.changed = true;
    if (!(now.flux > 0)) return;
    const bool placed = b.type != HW_LIGHT_SUN;  // a sun has no place
    changes_.moved = std::max(
        {changes_.moved, placed ? glm::distance(a.position, b.position) : 0.0f, glm::distance(a.axis_z, b.axis_z)});
    changes_.brightened |= grew(now.flux, before.flux) || grew(b.emission, a.emission) || opened(b.flags, a.flags) ||
                           a.spread_or_spot != b.spread_or_spot || a.spot_smooth != b.spot_smooth;
  }

  void world() {
    const LightSnapshot::World &before = before_.world, &now = now_.world;
    const bool in_both = before.index != HW_NONE && now.index != HW_NONE;
    if (in_both) blocks_.push_back({before.index, now.index, 1});
    const bool dark = now.program == 0 && now.color == vec3(0),
               was_dark = before.program == 0 && before.color == vec3(0);
    if (!(dark && was_dark)) {
      changes_.changed |= now.program != before.program || now.color != before.color || now.flags != before.flags;
      changes_.brightened |= !dark && ((now.program != 0 && now.program != before.program) ||
                                       grew(now.color, before.color) || opened(now.flags, before.flags));
    }
    // It can be sampled and could not.
    changes_.brightened |= now.index != HW_NONE && before.index == HW_NONE;
  }

  void emitters() {
    auto old = before_.emitters.begin();
    const auto last = before_.emitters.end();
    for (const Emitters& now : now_.emitters) {
      const Id end = now.first + now.instances;
      for (Id at = now.first; at < end;) {
        while (old != last && old->first + old->instances <= at) ++old;
        const Id start = old == last ? end : std::clamp(old->first, at, end);
        if (start > at) {
          appear(now, at, start);
          at = start;
        } else {
          const Id stop = std::min(end, old->first + old->instances);
          overlap(*old, now, at, stop);
          at = stop;
        }
      }
    }
  }

  const float* flux(const LightSnapshot& of, const Emitters& group, Id id) const {
    return of.flux.data() + group.flux_begin + (id - group.first);
  }

  void appear(const Emitters& now, Id begin, Id end) {
    changes_.changed = true;
    const float* values = flux(now_, now, begin);
    changes_.brightened |= std::any_of(values, values + (end - begin), [](float f) { return f > 0; });
  }

  // Instances [begin, end) are in both.
  void overlap(const Emitters& before, const Emitters& now, Id begin, Id end) {
    if (before.topology != now.topology || before.triangles != now.triangles) return appear(now, begin, end);
    const std::uint32_t t = now.triangles;
    blocks_.push_back({before.index + static_cast<std::uint32_t>(begin - before.first) * t,
                       now.index + static_cast<std::uint32_t>(begin - now.first) * t,
                       static_cast<std::uint32_t>(end - begin) * t});
    bool altered = before.placed != now.placed || before.shape != now.shape;
    for (std::uint32_t s = 0; s < std::min(before.slot_count, now.slot_count); ++s)
      altered |= compare(before_.slots[before.slot_begin + s], now_.slots[now.slot_begin + s],
                         before.appearance != now.appearance);
    if (!altered) return;
    changes_.changed = true;
    const float *a = flux(before_, before, begin), *b = flux(now_, now, begin);
    for (std::size_t i = 0; i < end - begin && !changes_.brightened; ++i)
      changes_.brightened = grew(b[i], a[i], kTriangleRounding);
  }

  // Whether they differ. `appearance`: the object's own data, which a program may read, were set again.
  bool compare(const Slot& before, const Slot& now, bool appearance) {
    const bool program = now.program != 0 && (appearance || now.program != before.program);
    if (!program && before.program == now.program && before.radiance == now.radiance &&
        before.emission == now.emission && before.flags == now.flags && before.back == now.back)
      return false;
    if (now.radiance > 0)
      changes_.brightened |= program || grew(now.radiance, before.radiance) || grew(now.emission, before.emission) ||
                             opened(now.flags, before.flags) || now.back != before.back;
    return true;
  }

  const LightSnapshot &before_, &now_;
  std::vector<Block> blocks_;
  LightChanges changes_;
};

}  // namespace

LightChanges compare_lights(const LightSnapshot& before, const LightSnapshot& now) {
  return Comparison(before, now).run();
}

std::uint64_t topology_hash(std::span<const std::uint32_t> tri_vertices, std::span<const std::uint8_t> tri_slots) {
  std::uint64_t hash = tri_vertices.size();
  const auto add = [&](std::span<const std::byte> bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
      hash = (std::rotl(hash, 23) ^ word) * 0x9e3779b97f4a7c15ull;
    }
  };
  add(std::as_bytes(tri_vertices));
  hash += tri_slots.size();
  add(std::as_bytes(tri_slots));
  return hash ^ hash >> 32;
}

}  // namespace hw

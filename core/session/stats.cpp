// SPDX-License-Identifier: Apache-2.0
// Statistics as JSON.
#include "session/stats.h"

#include <cmath>
#include <cstdio>

namespace hw {

namespace {

// Only what is needed: objects of numbers, strings and booleans in the order they are added.
class JsonObject {
 public:
  void number(const char* key, double v) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", std::isfinite(v) ? v : 0.0);
    add(key, text);
  }
  void integer(const char* key, std::uint64_t v) { add(key, std::to_string(v)); }
  void boolean(const char* key, bool v) { add(key, v ? "true" : "false"); }
  void string(const char* key, const std::string& v) { add(key, quote(v)); }
  void object(const std::string& key, const JsonObject& v) { add(key.c_str(), v.text()); }
  std::string text() const { return "{" + body_ + "}"; }

 private:
  static std::string quote(const std::string& v) {
    std::string out = "\"";
    for (char c : v) {
      if (c == '"' || c == '\\') {
        out += '\\';
        out += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        char text[8];
        std::snprintf(text, sizeof text, "\\u%04x", c);
        out += text;
      } else {
        out += c;
      }
    }
    return out + "\"";
  }
  void add(const char* key, const std::string& value) {
    body_ += (body_.empty() ? "" : ", ") + quote(key) + ": " + value;
  }
  std::string body_;
};

}  // namespace

std::string render_stats_json(const Context& context, const Tracer& tracer, const SyncReport& sync,
                              const Progress& progress, std::uint64_t wave_bytes, std::uint64_t reservoir_bytes,
                              const CellUse& cells) {
  JsonObject scene;
  scene.integer("meshes", sync.meshes);
  scene.integer("instances", sync.instances);
  scene.integer("triangles", sync.triangles);
  scene.integer("lights", sync.lights);
  scene.integer("materials", sync.materials);
  scene.integer("images", sync.images);

  JsonObject synced;
  synced.number("commit_seconds", sync.commit_seconds);
  synced.number("upload_seconds", sync.upload_seconds);
  synced.number("build_seconds", sync.build_seconds);
  synced.number("lights_seconds", sync.lights_seconds);
  synced.integer("meshes_uploaded", sync.meshes_uploaded);
  synced.integer("instances_uploaded", sync.instances_uploaded);
  synced.integer("bytes_uploaded", sync.bytes_uploaded);

  JsonObject stages, calls;
  for (const StageTime& s : context.device->stage_times()) {
    stages.number(s.name.c_str(), s.seconds);
    calls.integer(s.name.c_str(), s.calls);
  }

  JsonObject memory;
  memory.integer("device_bytes", context.device->bytes_in_use());
  memory.integer("device_peak_bytes", context.device->peak_bytes());
  memory.boolean("window", context.device->windowed());
  memory.integer("wave_bytes", wave_bytes);
  memory.integer("acceleration_bytes", tracer.stats().build_bytes);

  JsonObject out;
  out.string("device", context.device->info().name);
  out.string("driver", context.device->info().driver);
  out.string("tracer", tracer.name());
  out.object("scene", scene);
  out.object("sync", synced);
  out.integer("samples", progress.sample);
  out.number("seconds", progress.seconds);
  out.integer("rays", progress.rays);
  out.number("mrays_per_second", progress.seconds > 0 ? double(progress.rays) / progress.seconds * 1e-6 : 0);
  out.boolean("cancelled", progress.cancelled);
  out.integer("reservoir_bytes", reservoir_bytes);
  if (cells.count > 0) {
    out.integer("light_cells", cells.count);
    out.integer("light_cells_used", cells.used);
    out.boolean("lights_by_tree", cells.by_tree);
    out.boolean("path_reuse", cells.path_reuse);
    out.integer("bounce_samples", cells.bounce_samples);
  }
  out.object("stages", stages);
  out.object("stage_calls", calls);
  out.object("memory", memory);
  out.integer("submissions", context.device->submissions());
  out.integer("host_waits", context.device->host_waits());
  return out.text();
}

}  // namespace hw

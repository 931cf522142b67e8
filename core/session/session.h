// SPDX-License-Identifier: Apache-2.0
// One scene being rendered on one device: sync, a render on its own thread, progress, cancel, pixels out.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "session/settings.h"
#include "trace/tracer.h"

namespace hw {

class KernelCache;

// A device, and what its sessions share. Expensive to make; one serves many sessions, which render one after another.
// Each session has a Tracer of its own, so that its scene stays built while others render.
struct Context {
  Context();
  ~Context();
  std::unique_ptr<Device> device;
  std::unique_ptr<KernelCache> kernels;
  std::unique_ptr<Buffer> luts;  // albedo tables (materials/luts.h)
  int threads = 0;

  // A Tracer without geometry: one that another session has done with, or a new one. give_back() takes it again.
  std::unique_ptr<Tracer> lend_tracer();
  void give_back(std::unique_ptr<Tracer> tracer);
  const std::string& tracer_name() const { return tracer_name_; }  // as Tracer::name()

  // One session at a time renders or syncs. begin(): false when another does, or after close(); `cancel` is the flag
  // that ends it early, null where nothing does. end() follows every begin() that was true.
  bool begin(std::atomic<bool>* cancel);
  void end();
  // Cancels what is under way and waits until no thread of the context's works; nothing begins any more. Before the
  // process ends.
  void close();
  bool closed() const { return closed_; }

 private:
  friend std::shared_ptr<Context> make_context(const std::string&, const std::string&, int, bool);
  std::string tracer_name_;
  std::vector<std::unique_ptr<Tracer>> idle_tracers_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool busy_ = false;
  std::atomic<bool> closed_{false};
  std::atomic<bool>* cancel_ = nullptr;
};
std::shared_ptr<Context> make_context(const std::string& device, const std::string& tracer, int threads,
                                      bool validation);

struct SyncReport {
  double commit_seconds = 0, upload_seconds = 0, build_seconds = 0, lights_seconds = 0;
  std::uint64_t meshes = 0, instances = 0, lights = 0, triangles = 0, materials = 0, images = 0;  // now in the scene
  std::uint64_t meshes_uploaded = 0, instances_uploaded = 0, bytes_uploaded = 0;                  // by this sync
};

struct Progress {
  std::uint32_t sample = 0, samples = 0;
  std::uint64_t rays = 0;
  double seconds = 0, remaining = 0;  // remaining < 0: not known yet
  std::uint64_t memory_bytes = 0;
  std::string stage;  // what is being done now, for a status line
  bool finished = false, cancelled = false;
  std::string error;
};

class Session {
 public:
  Session(std::shared_ptr<Context> context, std::shared_ptr<Scene> scene);
  ~Session();  // cancels and joins

  Scene& scene() const;
  // scene.commit(), upload, build. Not while this or another session of the context renders (std::logic_error).
  SyncReport sync();
  // Throws std::invalid_argument naming a bad setting, std::logic_error when the scene was not synced or its last sync
  // failed, and when settings.resume asks to go on with a picture that is not there: another size or other passes, none
  // begun, or one that ended within a sample.
  void start(const RenderSettings& settings);
  bool wait(int milliseconds);  // true when the render has ended
  Progress progress() const;
  void cancel();  // ends within half a second; what was accumulated stays readable
  void finish();  // joins; throws what ended the render, if an error did
  std::vector<std::pair<std::string, int>> passes() const;       // name, channels, in the order asked for
  void size(std::uint32_t& width, std::uint32_t& height) const;  // of the region
  // Pixels of a pass, averaged over the samples so far: width * height * channels floats, bottom row first, linear.
  // std::logic_error when `floats` is another number: the size is another's since it was asked for.
  void read(const std::string& pass, float* out, std::size_t floats) const;
  std::string stats_json() const;  // seconds per stage, rays, Mrays/s, memory

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

// All passes by Cycles' names with their channel counts.
std::vector<std::pair<std::string, int>> all_passes();
std::vector<std::string> integrator_names();

}  // namespace hw

// SPDX-License-Identifier: Apache-2.0
// A render: its thread, the order of waves, what is known while it runs, and the pixels that come out.
#include "session/session.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "film/film.h"
#include "integrators/integrator.h"
#include "materials/luts.h"
#include "scene/tables.h"
#include "session/render_loop.h"
#include "session/stats.h"
#include "stages/stage.h"
#include "stages/wave.h"

namespace hw {

std::shared_ptr<Context> make_context(const std::string& device, const std::string& tracer, int threads,
                                      bool validation) {
  auto context = std::make_shared<Context>();
  context->threads = threads;
  context->device = std::make_unique<Device>(device, validation);
  context->tracer = make_tracer(*context->device, tracer, threads);
  context->kernels = std::make_unique<KernelCache>(*context->device);
  const std::vector<std::uint64_t> luts = albedo_lut_words();
  context->luts = context->device->upload(std::as_bytes(std::span(luts)), "albedo tables");
  return context;
}

Context::Context() = default;
Context::~Context() = default;

std::vector<std::pair<std::string, int>> all_passes() {
  std::vector<std::pair<std::string, int>> out;
  for (const PassInfo& p : pass_table()) out.emplace_back(p.name, p.channels);
  return out;
}

namespace {

void check(const RenderSettings& s) {
  auto bad = [](const std::string& what) { throw std::invalid_argument(what); };
  if (s.width == 0 || s.height == 0) bad("the picture has no pixels: width and height must be at least 1");
  if (s.width > 65536 || s.height > 65536) bad("the picture is larger than 65536 pixels on a side");
  if (s.region[2] <= s.region[0] || s.region[3] <= s.region[1] || s.region[2] > s.width || s.region[3] > s.height)
    bad("the render region is empty or reaches outside the picture");
  if (s.samples == 0) bad("samples must be at least 1");
  if (s.filter != "BLACKMAN_HARRIS" && s.filter != "GAUSSIAN" && s.filter != "BOX")
    bad("there is no pixel filter '" + s.filter + "'; the filters are BLACKMAN_HARRIS, GAUSSIAN, BOX");
  if (!(s.filter_width > 0) || s.filter_width > 64) bad("filter width must be between 0 and 64 pixels");
  if (s.lights != "uniform" && s.lights != "power")
    bad("there is no light choice '" + s.lights + "'; choices are uniform, power");
  if (s.mist_falloff != "LINEAR" && s.mist_falloff != "QUADRATIC" && s.mist_falloff != "INVERSE_QUADRATIC")
    bad("there is no mist falloff '" + s.mist_falloff + "'");
  if (!std::isfinite(s.exposure) || s.exposure < 0) bad("exposure must be finite and not negative");
  if (!(s.time_limit >= 0)) bad("the time limit must not be negative");
}

double seconds_since(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

}  // namespace

struct Session::Impl {
  std::shared_ptr<Context> context;
  std::shared_ptr<Scene> scene;
  Tables tables;
  SyncReport last_sync;

  RenderSettings settings;
  std::unique_ptr<Film> film;
  std::unique_ptr<Wave> wave;
  ReservoirStore reservoirs;
  std::thread thread;
  std::atomic<bool> cancelled{false};

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable ended;
  bool running = false;
  Progress progress;
  std::exception_ptr error;
  std::vector<float> sums;  // the film as last downloaded, with the sample counts that belong to it
  SampleCounts sums_counts;
  SampleCounts counts;  // the film as it stands
  std::atomic<bool> wants_download{false};
  std::chrono::steady_clock::time_point begun;

  Impl(std::shared_ptr<Context> c, std::shared_ptr<Scene> s)
      : context(std::move(c)), scene(std::move(s)), tables(*context->device, *scene, *context->tracer) {}

  void join() {
    if (thread.joinable()) thread.join();
  }

  void run();
  void download() {
    std::vector<float> now;
    film->download(now);
    std::lock_guard lock(mutex);
    sums.swap(now);
    sums_counts = counts;
  }
};

Session::Session(std::shared_ptr<Context> context, std::shared_ptr<Scene> scene)
    : impl_(std::make_unique<Impl>(std::move(context), std::move(scene))) {}

Session::~Session() {
  impl_->cancelled = true;
  impl_->join();
}

SyncReport Session::sync() {
  Impl& d = *impl_;
  {
    std::lock_guard lock(d.mutex);
    if (d.running) throw std::logic_error("the scene can't be synced while it is being rendered");
  }
  if (d.context->renders_for)
    throw std::logic_error("another session is rendering on this device: wait until it has finished");
  d.join();
  const auto t0 = std::chrono::steady_clock::now();
  d.scene->commit();
  SyncReport report;
  report.commit_seconds = seconds_since(t0);
  const TableCounts counts = d.tables.update();
  const TableTotals& totals = d.tables.totals();
  report.upload_seconds = counts.upload_seconds;
  report.build_seconds = counts.build_seconds;
  report.lights_seconds = counts.lights_seconds;
  report.meshes_uploaded = counts.meshes_uploaded;
  report.instances_uploaded = counts.instances_uploaded;
  report.bytes_uploaded = counts.bytes_uploaded;
  report.meshes = totals.meshes;
  report.instances = totals.instances;
  report.lights = totals.lights;
  report.triangles = totals.triangles;
  report.materials = totals.materials;
  report.images = totals.images;
  d.last_sync = report;
  return report;
}

void Session::start(const RenderSettings& asked) {
  Impl& d = *impl_;
  {
    std::lock_guard lock(d.mutex);
    if (d.running) throw std::logic_error("a render is already running in this session");
  }
  d.join();
  RenderSettings s = asked;
  if (s.region == std::array<std::uint32_t, 4>{0, 0, 0, 0}) s.region = {0, 0, s.width, s.height};
  check(s);
  const CameraRecord& camera = d.tables.root().camera;
  if (!(camera.right > camera.left && camera.top > camera.bottom))
    throw std::invalid_argument("the scene has no camera: set one and sync before rendering");
  if (!d.tables.current())
    throw std::logic_error(
        "the device does not hold this scene: sync it again (its last sync failed, or another session used "
        "the device since)");
  const FilmLayout layout = film_layout(s.passes);
  resolve_reuse(s);  // refuses what the integrator does not have
  const void* nobody = nullptr;
  if (!d.context->renders_for.compare_exchange_strong(nobody, &d))
    throw std::logic_error("another session is rendering on this device: wait until it has finished");
  d.settings = s;
  d.context->device->reset_stage_times();
  d.cancelled = false;
  d.wants_download = false;
  {
    std::lock_guard lock(d.mutex);
    d.progress = {};
    d.progress.samples = s.samples;
    d.progress.remaining = -1;
    d.progress.stage = "starting";
    d.error = nullptr;
    d.running = true;
    d.counts = d.sums_counts = {};
    d.sums.clear();
    d.begun = std::chrono::steady_clock::now();
  }
  try {
    const std::uint32_t width = s.region[2] - s.region[0], height = s.region[3] - s.region[1];
    if (!d.film || d.film->width() != width || d.film->height() != height || d.film->layout().mask != layout.mask ||
        d.film->layout().passes != layout.passes)
      d.film.reset(), d.film = std::make_unique<Film>(*d.context->device, layout, width, height);
    else
      d.film->clear();
    d.thread = std::thread([&d] { d.run(); });
  } catch (...) {
    std::lock_guard lock(d.mutex);
    d.running = false;
    d.progress.finished = true;
    d.context->renders_for = nullptr;
    throw;
  }
}

void Session::Impl::run() {
  tables.trim_heap();
  try {
    RenderLoop loop(*context, tables, *film, wave, reservoirs, settings, cancelled);
    loop.on_samples = [this](const SampleCounts& now, const RayCounters& rays) {
      const double seconds = seconds_since(begun);
      std::lock_guard lock(mutex);
      counts = now;
      const std::uint64_t pixels = std::uint64_t(film->width()) * film->height();
      const double done = double(now.samples) + double(now.extra) * double(now.split) / double(pixels);
      progress.sample = now.samples;
      progress.seconds = seconds;
      progress.rays = rays.camera + rays.indirect + rays.shadow + rays.transparent_shadow;
      progress.memory_bytes = context->device->bytes_in_use();
      progress.remaining = done > 0 ? seconds * (settings.samples - done) / done : -1;
      if (settings.time_limit > 0)
        progress.remaining = progress.remaining < 0
                                 ? settings.time_limit - seconds
                                 : std::min(progress.remaining, std::max(0.0, settings.time_limit - seconds));
      progress.stage = "rendering";
    };
    loop.on_stage = [this](const char* stage) {
      std::lock_guard lock(mutex);
      progress.stage = stage;
    };
    loop.on_idle = [this] {
      if (wants_download.exchange(false)) download();
    };
    loop.run();
    download();
  } catch (...) {
    std::lock_guard lock(mutex);
    error = std::current_exception();
    try {
      throw;
    } catch (const std::exception& e) {
      progress.error = e.what();
    } catch (...) {
      progress.error = "unknown error";
    }
  }
  std::lock_guard lock(mutex);
  progress.finished = true;
  progress.cancelled = cancelled;
  progress.seconds = seconds_since(begun);
  progress.remaining = 0;
  running = false;
  context->renders_for = nullptr;
  ended.notify_all();
}

bool Session::wait(int milliseconds) {
  Impl& d = *impl_;
  std::unique_lock lock(d.mutex);
  return d.ended.wait_for(lock, std::chrono::milliseconds(std::max(milliseconds, 0)), [&d] { return !d.running; });
}

Progress Session::progress() const {
  std::lock_guard lock(impl_->mutex);
  Progress p = impl_->progress;
  if (impl_->running) p.seconds = seconds_since(impl_->begun);
  return p;
}

void Session::cancel() { impl_->cancelled = true; }

void Session::finish() {
  Impl& d = *impl_;
  d.join();
  std::exception_ptr error;
  {
    std::lock_guard lock(d.mutex);
    std::swap(error, d.error);
  }
  if (error) std::rethrow_exception(error);
}

std::vector<std::pair<std::string, int>> Session::passes() const {
  std::vector<std::pair<std::string, int>> out;
  if (impl_->film)
    for (const PassInfo* p : impl_->film->layout().passes) out.emplace_back(p->name, p->channels);
  return out;
}

void Session::size(std::uint32_t& width, std::uint32_t& height) const {
  width = impl_->film ? impl_->film->width() : 0;
  height = impl_->film ? impl_->film->height() : 0;
}

void Session::read(const std::string& name, float* out) const {
  Impl& d = *impl_;
  if (!d.film) throw std::logic_error("nothing has been rendered yet");
  const PassInfo* pass = find_pass(name);
  if (!pass || !(d.film->layout().mask & (1u << pass->bit)))
    throw std::invalid_argument("this render keeps no pass named '" + name + "'");
  bool running;
  {
    std::lock_guard lock(d.mutex);
    running = d.running;
  }
  if (running) d.wants_download = true;  // the render thread brings newer pixels for the next call
  std::lock_guard lock(d.mutex);
  if (d.sums.empty()) {
    std::fill_n(out, std::size_t(d.film->width()) * d.film->height() * pass->channels, 0.0f);
    return;
  }
  d.film->resolve(d.sums, *pass, d.sums_counts, d.settings.exposure, out);
}

std::string Session::stats_json() const {
  Impl& d = *impl_;
  return render_stats_json(*d.context, d.last_sync, progress(), d.wave ? d.wave->bytes() : 0,
                           d.reservoirs.bytes());
}

}  // namespace hw

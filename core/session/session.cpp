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
#include <optional>
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
  context->idle_tracers_.push_back(make_tracer(*context->device, tracer, threads));
  context->tracer_name_ = context->idle_tracers_.back()->name();
  context->kernels = std::make_unique<KernelCache>(*context->device);
  const std::vector<std::uint64_t> luts = albedo_lut_words();
  context->luts = context->device->upload(std::as_bytes(std::span(luts)), "albedo tables");
  return context;
}

Context::Context() = default;
Context::~Context() = default;

std::unique_ptr<Tracer> Context::lend_tracer() {
  {
    std::lock_guard lock(mutex_);
    if (!idle_tracers_.empty()) {
      auto tracer = std::move(idle_tracers_.back());
      idle_tracers_.pop_back();
      return tracer;
    }
  }
  return make_tracer(*device, tracer_name_, threads);
}

void Context::give_back(std::unique_ptr<Tracer> tracer) {
  std::lock_guard lock(mutex_);
  if (idle_tracers_.empty()) idle_tracers_.push_back(std::move(tracer));  // more than one at rest is waste
}

bool Context::begin(std::atomic<bool>* cancel) {
  std::lock_guard lock(mutex_);
  if (busy_ || closed_) return false;
  busy_ = true;
  cancel_ = cancel;
  return true;
}

void Context::end() {
  std::lock_guard lock(mutex_);
  busy_ = false;
  cancel_ = nullptr;
  ended_.notify_all();
}

void Context::close() {
  {
    std::unique_lock lock(mutex_);
    closed_ = true;
    if (cancel_) *cancel_ = true;
    ended_.wait(lock, [this] { return !busy_; });
  }
  kernels->wait();
}

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
  if (s.lights != "auto" && s.lights != "uniform" && s.lights != "power" && s.lights != "tree")
    bad("there is no light choice '" + s.lights + "'; choices are auto, uniform, power, tree");
  if (s.lights == "tree" && s.integrator != "path" && s.integrator != "wssr-hash")
    bad("the integrator '" + s.integrator + "' does not choose lights by the tree; 'path' does");
  if (s.mist_falloff != "LINEAR" && s.mist_falloff != "QUADRATIC" && s.mist_falloff != "INVERSE_QUADRATIC")
    bad("there is no mist falloff '" + s.mist_falloff + "'");
  if (!std::isfinite(s.exposure) || s.exposure < 0) bad("exposure must be finite and not negative");
  if (!(s.time_limit >= 0)) bad("the time limit must not be negative");
  if (!(s.noise_threshold >= 0)) bad("the noise threshold must not be negative");
}

std::uint32_t region_width(const RenderSettings& s) { return s.region[2] - s.region[0]; }
std::uint32_t region_height(const RenderSettings& s) { return s.region[3] - s.region[1]; }

[[noreturn]] void refuse(const Context& context) {
  throw std::logic_error(context.closed() ? "the process is ending: nothing is rendered any more"
                                          : "another session is rendering on this device: wait until it has finished");
}

double seconds_since(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

}  // namespace

struct Session::Impl {
  std::shared_ptr<Context> context;
  std::shared_ptr<Scene> scene;
  std::unique_ptr<Tracer> tracer;
  std::optional<Tables> tables;  // always there but while the session ends

  RenderSettings settings;
  std::unique_ptr<Film> film;
  std::unique_ptr<Wave> wave;
  ReservoirStore reservoirs;
  std::thread thread;
  std::atomic<bool> cancelled{false};

  std::atomic<std::uint64_t> wave_bytes{0};

  mutable std::mutex mutex;  // guards what follows, and that `film` and `settings` are another's
  std::condition_variable ended;
  SyncReport last_sync;
  CellUse cells;
  bool running = false;
  Progress progress;
  std::exception_ptr error;
  std::vector<float> sums;  // the film as last downloaded, with the sample counts that belong to it
  SampleCounts sums_counts;
  SampleCounts counts;  // the film as it stands
  std::atomic<bool> wants_download{false};
  std::chrono::steady_clock::time_point begun;

  Impl(std::shared_ptr<Context> c, std::shared_ptr<Scene> s)
      : context(std::move(c)), scene(std::move(s)), tracer(context->lend_tracer()) {
    tables.emplace(*context->device, *scene, *tracer);
  }
  ~Impl() {
    tables.reset();  // takes its geometry out of the Tracer
    context->give_back(std::move(tracer));
  }

  void join() {
    if (thread.joinable()) thread.join();
  }

  bool film_fits(const FilmLayout& layout, const RenderSettings& s) const {
    return film && film->width() == region_width(s) && film->height() == region_height(s) &&
           film->layout().mask == layout.mask && film->layout().passes == layout.passes &&
           film->layout().weighted == layout.weighted;
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

Scene& Session::scene() const { return *impl_->scene; }

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
  d.join();
  if (!d.context->begin(nullptr)) refuse(*d.context);
  const std::unique_ptr<Context, void (*)(Context*)> until_return(d.context.get(), [](Context* c) { c->end(); });
  const auto t0 = std::chrono::steady_clock::now();
  d.scene->commit(d.context->threads);
  SyncReport report;
  report.commit_seconds = seconds_since(t0);
  const TableCounts counts = d.tables->update();
  const TableTotals& totals = d.tables->totals();
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
  std::lock_guard lock(d.mutex);
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
  const CameraRecord& camera = d.tables->root().camera;
  if (!(camera.right > camera.left && camera.top > camera.bottom))
    throw std::invalid_argument("the scene has no camera: set one and sync before rendering");
  if (!d.tables->current())
    throw std::logic_error(
        "the device does not hold this scene: sync it again (it was never synced, or its last sync failed)");
  FilmLayout layout = film_layout(s.passes);
  layout.weighted = samples_adaptively(s);
  resolve_reuse(s);  // refuses what the integrator does not have
  if (s.resume) {
    std::lock_guard lock(d.mutex);
    if (d.counts.samples == 0 || d.counts.extra != 0 || !d.film_fits(layout, s))
      throw std::logic_error("there is no picture of this size and these passes to go on with");
    if (s.samples <= d.counts.samples) throw std::logic_error("the picture to go on with has its samples already");
  }
  d.cancelled = false;
  if (!d.context->begin(&d.cancelled)) refuse(*d.context);
  d.context->device->reset_stage_times();
  d.wants_download = false;
  {
    std::lock_guard lock(d.mutex);
    d.settings = s;
    d.progress = {};
    d.progress.samples = s.samples;
    d.progress.remaining = -1;
    d.progress.stage = "starting";
    d.error = nullptr;
    d.running = true;
    if (!s.resume) {
      d.counts = d.sums_counts = {};
      d.sums.clear();
    }
    d.begun = std::chrono::steady_clock::now();
  }
  try {
    if (!d.film_fits(layout, s)) {
      const auto put = [&d](std::unique_ptr<Film> film) {
        std::lock_guard lock(d.mutex);
        d.film = std::move(film);
      };
      put(nullptr);  // its memory may be needed for the new one
      put(std::make_unique<Film>(*d.context->device, layout, region_width(s), region_height(s)));
    } else if (!s.resume)
      d.film->clear();
    d.thread = std::thread([&d] { d.run(); });
  } catch (...) {
    std::lock_guard lock(d.mutex);
    d.running = false;
    d.progress.finished = true;
    d.context->end();
    throw;
  }
}

void Session::Impl::run() {
  tables->trim_heap();
  try {
    RenderLoop loop(*context, *tracer, *tables, *film, wave, reservoirs, settings, counts, cancelled);
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
      wave_bytes = wave ? wave->bytes() : 0;
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
  context->end();
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
  std::lock_guard lock(impl_->mutex);
  if (impl_->film)
    for (const PassInfo* p : impl_->film->layout().passes) out.emplace_back(p->name, p->channels);
  return out;
}

void Session::size(std::uint32_t& width, std::uint32_t& height) const {
  std::lock_guard lock(impl_->mutex);
  width = impl_->film ? impl_->film->width() : 0;
  height = impl_->film ? impl_->film->height() : 0;
}

void Session::read(const std::string& name, float* out, std::size_t floats) const {
  Impl& d = *impl_;
  std::lock_guard lock(d.mutex);
  if (!d.film) throw std::logic_error("nothing has been rendered yet");
  const PassInfo* pass = find_pass(name);
  if (!pass || !(d.film->layout().mask & (1u << pass->bit)))
    throw std::invalid_argument("this render keeps no pass named '" + name + "'");
  if (floats != std::size_t(d.film->width()) * d.film->height() * pass->channels)
    throw std::logic_error("pass '" + name + "' has another size than what was asked for");
  if (d.running) d.wants_download = true;  // the render thread brings newer pixels for the next call
  if (d.sums.empty()) {
    std::fill_n(out, floats, 0.0f);
    return;
  }
  d.film->resolve(d.sums, *pass, d.sums_counts, d.settings.exposure, out);
}

std::string Session::stats_json() const {
  Impl& d = *impl_;
  const Progress now = progress();
  std::lock_guard lock(d.mutex);
  // Cells are counted on the device, so not while anyone renders there: then by the last count.
  if (!d.running && d.reservoirs.light_cells && d.context->begin(nullptr)) {
    const std::unique_ptr<Context, void (*)(Context*)> until_return(d.context.get(), [](Context* c) { c->end(); });
    d.cells = {d.reservoirs.light_cells->count(), d.reservoirs.light_cells->used(*d.context->device),
               d.reservoirs.light_cells->by_tree, d.reservoirs.light_cells->path_reuse,
               d.reservoirs.light_cells->bounce_samples};
  }
  if (!d.running && !d.reservoirs.light_cells) d.cells = {};
  return render_stats_json(*d.context, *d.tracer, d.last_sync, now, d.wave_bytes, d.reservoirs.bytes(), d.cells);
}

}  // namespace hw

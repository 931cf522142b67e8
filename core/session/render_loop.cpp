// SPDX-License-Identifier: Apache-2.0
// Waves over the picture.
#include "session/render_loop.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "integrators/integrator.h"
#include "integrators/path_reuse.h"
#include "lib/camera.h"
#include "stages/triangle_emission.h"
#include "stages/world_luminance.h"

namespace hw {

namespace {

// Paths in flight. On a CPU a wave should stay near the last-level cache; a GPU wants enough to fill it.
constexpr std::uint32_t kHostWave = 1u << 16;
constexpr std::uint32_t kDeviceWave = 1u << 20;
// A wave takes at most this share of what the device has.
constexpr double kMemoryShare = 0.25;

// What every kernel of this scene must hold, whatever the object (shared/features.h).
std::uint32_t scene_features(const Tables& tables) {
  const TableTotals& t = tables.totals();
  std::uint32_t features = 0;
  if (t.smooth_normals) features |= HW_FEATURE_BUMP;
  if (t.texel_formats) features |= HW_FEATURE_TEXEL_FORMATS;
  if (t.material_flags & HW_MATERIAL_TRANSPARENT) features |= HW_FEATURE_TRANSPARENT;
  if (t.material_flags & HW_MATERIAL_EMISSION_SHADER) features |= HW_FEATURE_EMISSION_PROGRAM;
  if (tables.root().world_material != HW_NONE) features |= HW_FEATURE_WORLD_PROGRAM;
  return features;
}

// Whether a ray that a BSDF chose can still find light after the last bounce.
bool bsdf_hits_emit(const Tables& tables) {
  const Root& root = tables.root();
  const vec3 c = root.world_color;
  const bool world = root.world_material != HW_NONE || c.x > 0 || c.y > 0 || c.z > 0;
  return world || root.light_count > 0 || (tables.totals().material_flags & HW_MATERIAL_EMISSIVE);
}

// What a pixel is wide: per metre of distance, or in metres where the camera is orthographic.
float pixel_size(const CameraRecord& camera, std::uint32_t width) {
  return camera_width(camera) / static_cast<float>(width);
}

// HW_FRAME_* of the scene.
std::uint32_t frame_flags(const Tables& tables) {
  const Root& root = tables.root();
  std::uint32_t flags = bsdf_hits_emit(tables) ? HW_FRAME_BSDF_HITS_EMIT : 0u;
  if (tables.totals().material_flags & (HW_MATERIAL_EMISSIVE | HW_MATERIAL_TRANSPARENT)) return flags;
  const vec3 c = root.world_color;
  const bool world = root.world_material != HW_NONE || c.x > 0 || c.y > 0 || c.z > 0 || root.sun_count > 0;
  return flags | HW_FRAME_SURFACES_DARK | (world ? 0u : HW_FRAME_MISSES_DARK);
}

// With fewer lights there is nothing to choose; from here on the tree was never the worse
// (docs/measurements/light_tree.md).
constexpr std::uint32_t kTreeLights = 2;

// What "auto" stands for. Integrators that reuse light samples draw their candidates by power.
std::string light_choice(const RenderSettings& settings, const Tables& tables) {
  if (settings.lights != "auto") return settings.lights;
  const std::uint32_t lights = tables.root().light_count;
  return lights >= kTreeLights && renders_by_path(settings, lights) ? "tree" : "power";
}

}  // namespace

RenderLoop::RenderLoop(Context& context, Tracer& tracer, Tables& tables, Film& film, std::unique_ptr<Wave>& wave,
                       ReservoirStore& reservoirs, const RenderSettings& settings, const SampleCounts& begun,
                       const std::atomic<bool>& cancelled)
    : context_(context),
      tracer_(tracer),
      tables_(tables),
      film_(film),
      wave_(wave),
      reservoirs_(reservoirs),
      settings_(settings),
      begun_(begun),
      cancelled_(cancelled) {}

void RenderLoop::choose_wave() {
  Device& device = *context_.device;
  const std::uint64_t pixels = std::uint64_t(film_.width()) * film_.height();
  const bool small = device.shared_memory() || device.info().kind == "cpu";
  const std::uint32_t light_samples = hw::light_samples(settings_, tables_.root().light_count);
  std::uint64_t capacity = small ? kHostWave : std::max(kDeviceWave / light_samples, kHostWave);
  if (settings_.tile_pixels) capacity = settings_.tile_pixels;
  // Waves that path reuse takes hold whole groups of pixels.
  const std::uint64_t most_ways = most_bounce_samples(settings_);
  const bool adaptive = samples_adaptively(settings_);
  const std::uint64_t ways = resolve_reuse(settings_).bounce_samples ? most_ways : 1;
  const std::uint64_t least = reuse_wave_pixels(film_.width(), adaptive) * (ways + 1);
  const auto fits_with = [&](bool reuse) {
    return std::uint64_t(double(device.info().memory_bytes) * kMemoryShare) /
           wave_bytes_per_path(light_samples, reuse, film_.layout());
  };
  const bool reuse = reuses_paths(settings_, tables_.root().light_count) && least <= fits_with(true);
  const std::uint64_t fits = fits_with(reuse);
  capacity = std::min<std::uint64_t>(
      capacity, 65535u * HW_GROUP_SIZE / std::max(light_samples, reuse ? HW_REUSE_PIXELS : 1u));  // queue_prepare.comp
  capacity = std::min(
      {capacity, std::max<std::uint64_t>(fits, 1024), pixels * settings_.samples * (most_ways + (reuse ? 1 : 0))});
  if (reuse) capacity = std::max(capacity, least);
  capacity = std::max<std::uint64_t>((capacity + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE * HW_GROUP_SIZE, HW_GROUP_SIZE);
  if (wave_ && wave_->capacity() == capacity && wave_->light_samples() == light_samples &&
      wave_->path_reuse() == reuse && wave_->layout_mask() == film_.layout().mask)
    return;
  wave_.reset();
  wave_ = std::make_unique<Wave>(device, std::uint32_t(capacity), light_samples, reuse, film_.layout());
}

SpecConstants RenderLoop::constants_for(std::uint32_t features) const {
  return {{0, features | scene_features(tables_)},
          {1, film_.layout().mask},
          {2, film_.layout().light_passes ? 1u : 0u},
          {3, tables_.light_kinds()},
          {4, 0u}};
}

void RenderLoop::measure_lights(Commands& commands) {
  const auto grid = tables_.world_luminance_wanted();
  if (!grid && !tables_.emission_wanted()) return;
  on_stage("preparing lights");
  apply_settings(wave_->params(), settings_, film_.layout());
  wave_->write_params(commands);
  commands.flush();
  Device& device = *context_.device;
  const SpecConstants constants = constants_for(tables_.totals().classes.all | tables_.world_features());
  while (const EmissionGrid* wanted = tables_.emission_wanted())
    tables_.set_emission(measure_emission(device, *context_.kernels, tables_.root_buffer(), *wave_->frame, constants,
                                          wanted->lights, wanted->size, wanted->taps, cancelled_));
  if (grid)
    tables_.set_world_luminance(measure_world(device, *context_.kernels, tables_.root_buffer(), *wave_->frame,
                                              constants, grid->width, grid->height, cancelled_),
                                grid->width, grid->height);
}

void RenderLoop::run() {
  const KernelCache::Interruptible interruptible(*context_.kernels, cancelled_);
  try {
    render();
  } catch (const RenderCancelled&) {  // while kernels were compiled
  }
}

void RenderLoop::render() {
  Device& device = *context_.device;
  const auto begun = std::chrono::steady_clock::now();
  choose_wave();
  Wave& wave = *wave_;
  Commands commands(device);

  tables_.set_luts(context_.luts->address());
  measure_lights(commands);

  // Cells are over the tree, whatever is asked for.
  const bool cells = settings_.integrator == "wssr-hash" && !renders_by_path(settings_, tables_.root().light_count);
  const std::string choice = cells ? "tree" : light_choice(settings_, tables_);
  tables_.choose_lights(choice);
  const ShadingClasses& classes = tables_.totals().classes;
  const bool tree = choice == "tree" && tables_.root().light_tree_nodes > 0;
  const std::uint32_t choice_features =
      (tree ? HW_FEATURE_LIGHT_TREE : 0u) | (tree && cells ? HW_FEATURE_LIGHT_CELLS : 0u);
  const SpecConstants constants = constants_for(classes.all | tables_.world_features() | choice_features);
  std::vector<SpecConstants> class_constants;
  for (std::uint32_t features : classes.features) class_constants.push_back(constants_for(features | choice_features));
  commands.set_uniforms(tables_.root_buffer(), *wave.frame);

  apply_settings(wave.params(), settings_, film_.layout());
  wave.params().light_samples = wave.light_samples();
  // Integrators may find a better number.
  wave.set_bounce_samples(std::max(resolve_reuse(settings_).bounce_samples, 1u), wave.path_reuse());
  wave.params().first_sample_of_render = settings_.first_sample;
  wave.params().film = film_.sums().address();
  wave.params().frame_flags = frame_flags(tables_);
  wave.pace.begin();
  wave.reset_counters(commands);

  on_stage("loading kernels");
  const IntegratorContext context{device,
                                  tracer_,
                                  *context_.kernels,
                                  wave,
                                  constants,
                                  class_constants,
                                  (tables_.totals().material_flags & HW_MATERIAL_TRANSPARENT) != 0,
                                  settings_,
                                  cancelled_,
                                  reservoirs_,
                                  tables_.root().light_count,
                                  tables_.light_power(),
                                  tables_.take_light_changes(),
                                  tables_.radius(),
                                  camera_position(tables_.root().camera),
                                  pixel_size(tables_.root().camera, settings_.width),
                                  film_.width(),
                                  film_.height(),
                                  context_.threads,
                                  tables_.light_tree_revision(),
                                  tables_.light_tree_fit(),
                                  tables_.light_tree_unit()};
  // Buffers that integrators keep may be the ones that no longer fit in the device's memory window, which kernels that
  // are made already would look for them in.
  bool windowed;
  std::unique_ptr<Integrator> integrator;
  do {
    windowed = device.windowed();
    integrator.reset();
    integrator = make_integrator(context);
    const bool weighted = film_.layout().weighted;
    accumulate_ = &context_.kernels->get(weighted ? "accumulate_sampled" : "accumulate", constants);
    adaptive_.reset();
    if (weighted) adaptive_.emplace(device, wave, film_, settings_);
    integrator->begin_frame(commands);
  } while (device.windowed() != windowed);
  if (passes(commands, *integrator, begun)) submit(commands);
  report(commands);  // a cancelled render drops what it has recorded, and keeps what ran
}

bool RenderLoop::passes(Commands& commands, Integrator& integrator, std::chrono::steady_clock::time_point begun) {
  SampleCounts counts = begun_;
  const std::uint32_t pixels = film_.width() * film_.height();
  for (int preparation = 0; preparation < integrator.preparations(); ++preparation) {
    on_stage("preparing reservoirs");
    const std::uint32_t each = integrator.preparation_pixels();
    if (!pass(commands, integrator, (pixels + each - 1) / each, 1, preparation, counts)) return false;
  }
  const bool several = integrator.samples_are_independent() && !adaptive_ && !wave_->path_reuse();
  while (counts.samples < settings_.samples) {
    const std::uint32_t per_wave =
        several ? std::clamp(wave_->capacity() / wave_->places() / pixels, 1u, settings_.samples - counts.samples) : 1;
    const std::uint32_t sampled = adaptive_ ? adaptive_->begin_pass(commands) * HW_BLOCK_PIXELS : pixels;
    if (!pass(commands, integrator, sampled, per_wave, -1, counts)) return false;
    counts = {counts.samples + per_wave, 0, 0};
    recorded_.push_back({counts, film_flushes_});
    report(commands);
    if (settings_.time_limit > 0 &&
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() >= settings_.time_limit)
      break;
    if (adaptive_ && !adaptive_->end_pass(commands)) break;
  }
  return true;
}

void RenderLoop::submit(Commands& commands) {
  wave_->record_counters(commands);
  wave_->pace.submit(commands);
  report(commands);
}

void RenderLoop::report(const Commands& commands) {
  const auto waiting = std::find_if(recorded_.begin(), recorded_.end(),
                                    [&](const Recorded& r) { return r.flushes >= commands.flushes(); });
  if (waiting == recorded_.begin()) return;
  on_samples(std::prev(waiting)->counts, wave_->counters());
  recorded_.erase(recorded_.begin(), waiting);
}

bool RenderLoop::pass(Commands& commands, Integrator& integrator, std::uint32_t pixels, std::uint32_t per_wave,
                      int preparation, SampleCounts& counts) {
  Wave& wave = *wave_;
  std::uint32_t wave_pixels = std::min(pixels, wave.capacity() / wave.places() / per_wave);
  if (wave.path_reuse() && preparation < 0 && wave_pixels < pixels) {
    const std::uint32_t whole = reuse_wave_pixels(film_.width(), adaptive_.has_value());
    wave_pixels = std::max(wave_pixels / whole, 1u) * whole;
  }
  integrator.begin_pass(commands);
  for (std::uint32_t first = 0; first < pixels; first += wave_pixels) {
    FrameParams& p = wave.params();
    p.first_pixel = first;
    p.pixels_a_path = preparation < 0 ? 1 : integrator.preparation_pixels();
    p.wave_pixels = std::min(wave_pixels, pixels - first);
    p.wave_samples = per_wave;
    p.first_sample = settings_.first_sample + counts.samples;
    // Preparations draw other numbers than the sample they come before.
    const std::uint32_t seed = integrator.seed(settings_.seed);
    p.preparation_seed = seed ^ std::uint32_t(settings_.first_sample + integrator.preparation_set(preparation));
    p.seed = preparation < 0 ? seed : seed ^ (0x9e3779b9u * std::uint32_t(preparation + 1));
    wave.write_params(commands);
    if (preparation >= 0) {
      if (!integrator.prepare(commands, preparation)) return false;
    } else {
      if (!integrator.render(commands)) return false;
      commands.begin_stage("film");
      Push push{};
      commands.dispatch(*accumulate_, push.bytes(), (p.wave_pixels + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE);
      counts.extra = per_wave;
      // Of pixels of the film, also where a pass is of some of them.
      const std::uint64_t of_film = std::uint64_t(film_.width()) * film_.height();
      counts.split = std::uint32_t(of_film * std::min(first + wave_pixels, pixels) / pixels);
      film_flushes_ = commands.flushes();
      recorded_.push_back({counts, film_flushes_});
    }
    if (tracer_.runs_on_host() || wave.pace.due() || wave.pace.late()) {
      submit(commands);
      on_idle();
    }
    if (cancelled_) return false;
  }
  integrator.end_pass(commands, preparation);
  return true;
}

}  // namespace hw

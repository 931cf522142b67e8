// SPDX-License-Identifier: Apache-2.0
// headwater._core.Context and Session, and what there is to choose from: devices, integrators, passes.
#include "session/session.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <string>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/gil.h"
#include "python/settings.h"

namespace hw::python {

using namespace nb::literals;

namespace {

nb::dict device_dict(const DeviceInfo& info) {
  nb::dict d;
  d["name"] = info.name;
  d["driver"] = info.driver;
  d["kind"] = info.kind;
  d["api"] = std::to_string(info.api_major) + "." + std::to_string(info.api_minor);
  d["memory"] = info.memory_bytes;
  d["usable"] = info.usable;
  d["why_not"] = info.why_not;
  d["ray_query"] = info.ray_query;
  d["ray_pipeline"] = info.ray_pipeline;
  d["ray_query_why_not"] = info.ray_query_why_not;
  d["ray_pipeline_why_not"] = info.ray_pipeline_why_not;
  return d;
}

nb::dict reuse_dict(const ReuseParams& p) {
  const char* weights[] = {"1/M", "1/Z", "mis", "mis"};
  nb::dict d;
  d["candidates"] = p.candidates;
  d["indirect_candidates"] = p.indirect_candidates;
  d["neighbours"] = p.neighbours;
  d["reuse_radius"] = p.reuse_radius;
  d["ascension"] = p.ascension;
  d["grid_radius"] = p.grid_radius;
  d["grid_resolution"] = p.grid_resolution;
  d["grid_extent"] = p.grid_extent;
  d["cell_inputs"] = p.cell_inputs;
  d["points_per_leaf"] = p.points_per_leaf;
  d["light_samples"] = p.light_samples;
  d["bounce_samples"] = p.bounce_samples;
  d["path_reuse"] = p.path_reuse;
  d["reservoir_memory"] = p.reservoir_memory;
  d["reservoirs_per_cell"] = p.reservoirs_per_cell;
  d["history"] = p.history;
  d["temporal_reuse"] = p.temporal_reuse;
  d["spatial_reuse"] = p.spatial_reuse;
  d["visibility_reuse"] = p.visibility_reuse;
  d["reuse_weights"] = weights[std::uint32_t(p.weights)];
  d["mis_weights"] = p.weights == ReuseWeights::kBalance ? "balance" : "pairwise";
  d["grid_follow"] = p.grid_rides ? "camera" : "world";
  d["empty_cells"] = p.black_where_empty ? "black" : "canonical";
  return d;
}

nb::list integrator_dicts() {
  nb::list out;
  for (const IntegratorInfo& info : integrator_table()) {
    const auto chosen = [](const std::vector<std::string>& parameters, const ReuseParams& values) {
      const nb::dict all = reuse_dict(values);
      nb::dict read;
      for (const std::string& name : parameters) read[name.c_str()] = all[name.c_str()];
      return read;
    };
    nb::dict d;
    d["name"] = info.name;
    d["label"] = info.label;
    d["description"] = info.description;
    d["parameters"] = chosen(info.parameters, info.defaults);
    d["unbiased_parameters"] = chosen(info.unbiased_parameters, info.unbiased);
    out.append(d);
  }
  return out;
}

nb::list devices() {
  std::vector<DeviceInfo> found;
  {
    const WithoutGil release;  // loads drivers
    found = list_devices();
  }
  nb::list list;
  for (const DeviceInfo& info : found) list.append(device_dict(info));
  return list;
}

std::shared_ptr<Context> new_context(const std::string& device, const std::string& tracer, int threads,
                                     bool validation) {
  if (threads < 0) throw nb::value_error("threads must be 0 (all) or more");
  const WithoutGil release;
  auto context = make_context(device, tracer, threads, validation);
  close_at_exit(context);
  return context;
}

nb::dict sync(Session& session) {
  SyncReport r;
  {
    const WithoutGil release;
    r = session.sync();
  }
  session.scene().take_done_keepers();  // their end needs the GIL, which is not waited for while anything is built
  nb::dict d;
  d["commit_seconds"] = r.commit_seconds;
  d["upload_seconds"] = r.upload_seconds;
  d["build_seconds"] = r.build_seconds;
  d["lights_seconds"] = r.lights_seconds;
  d["meshes"] = r.meshes;
  d["instances"] = r.instances;
  d["lights"] = r.lights;
  d["triangles"] = r.triangles;
  d["materials"] = r.materials;
  d["images"] = r.images;
  d["meshes_uploaded"] = r.meshes_uploaded;
  d["instances_uploaded"] = r.instances_uploaded;
  d["bytes_uploaded"] = r.bytes_uploaded;
  return d;
}

nb::dict progress(const Session& session) {
  const Progress p = session.progress();
  nb::dict d;
  d["sample"] = p.sample;
  d["samples"] = p.samples;
  d["rays"] = p.rays;
  d["mrays"] = p.seconds > 0 ? static_cast<double>(p.rays) * 1e-6 / p.seconds : 0.0;
  d["seconds"] = p.seconds;
  d["remaining"] = p.remaining;
  d["memory"] = p.memory_bytes;
  d["stage"] = p.stage;
  d["finished"] = p.finished;
  d["cancelled"] = p.cancelled;
  d["error"] = p.error;
  return d;
}

nb::object read(const Session& session, const std::string& name, nb::object out) {
  const auto passes = session.passes();
  const auto pass = std::find_if(passes.begin(), passes.end(), [&](const auto& p) { return p.first == name; });
  if (pass == passes.end()) {
    std::string known;
    for (const auto& p : passes) known += (known.empty() ? "" : ", ") + p.first;
    throw nb::value_error(
        ("no pass \"" + name + "\" is being rendered (there are: " + (known.empty() ? "none" : known) + ")").c_str());
  }
  std::uint32_t width = 0, height = 0;
  session.size(width, height);
  const std::size_t channels = static_cast<std::size_t>(pass->second);
  if (out.is_none()) {
    auto pixels = std::make_unique<float[]>(std::size_t{width} * height * channels);
    {
      const WithoutGil release;
      session.read(name, pixels.get(), std::size_t{width} * height * channels);
    }
    float* data = pixels.get();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<float*>(p); });
    pixels.release();
    return nb::cast(nb::ndarray<nb::numpy, float, nb::ndim<3>>(data, {height, width, channels}, owner));
  }
  take<float>(out, {height, width, static_cast<std::int64_t>(channels)}, "out");
  nb::ndarray<nb::device::cpu> target;
  if (!nb::try_cast(out, target)) throw nb::value_error("out must be writable");
  float* data = static_cast<float*>(target.data());
  const WithoutGil release;
  session.read(name, data, std::size_t{width} * height * channels);
  return out;
}

void bind_context(nb::module_& m) {
  nb::class_<Context>(
      m, "Context",
      "A Vulkan device and its kernels. Expensive to make: keep it. One of its sessions renders at a time.")
      .def(nb::new_(&new_context), "device"_a = "", "tracer"_a = "auto", "threads"_a = 0, "validation"_a = false,
           "device: empty for the best, a part of a device's name, its index, or \"gpu\", \"discrete\", "
           "\"integrated\",\n"
           "    \"cpu\". tracer: \"auto\", \"embree\", \"ray_query\" or \"ray_pipeline\". threads: of the host, 0: "
           "all.\n"
           "validation: turn on Vulkan's validation layers.\n"
           "DeviceError when there is no such device, or it can't do what is needed; the message says why.")
      .def_prop_ro(
          "device", [](const Context& c) { return device_dict(c.device->info()); },
          "The device in use: as devices() has it.")
      .def_prop_ro(
          "tracer", [](const Context& c) { return c.tracer_name(); }, "\"embree\", \"ray_query\" or \"ray_pipeline\".")
      .def_prop_ro(
          "shared_memory", [](const Context& c) { return c.device->shared_memory(); },
          "Whether the device shares the host's memory: meshes then lie in its buffers alone.")
      .def_prop_ro(
          "validation_messages", [](const Context& c) { return c.device->validation_messages(); },
          "Messages of the validation layers so far; they are printed to stderr.")
      .def_prop_ro(
          "memory", [](const Context& c) { return c.device->bytes_in_use(); }, "Bytes of device buffers in use.")
      .def_prop_ro(
          "peak_memory", [](const Context& c) { return c.device->peak_bytes(); }, "The most there were.")
      .def(
          "set_memory_limit", [](Context& c, std::uint64_t bytes) { c.device->set_memory_limit(bytes); }, "bytes"_a,
          "Buffers that would go past this many bytes raise OutOfMemory; 0: no limit.");
}

}  // namespace

void bind_session(nb::module_& m) {
  bind_context(m);
  nb::class_<Session>(
      m, "Session",
      "A scene being rendered on a device. Keeps the scene's tables on the device from frame to frame.\n\n"
      "progress(), read(), wait() and cancel() may be called from any thread while a render is under way;\n"
      "scene edits may be made then too, sync() may not.")
      .def(nb::init<std::shared_ptr<Context>, std::shared_ptr<Scene>>(), "context"_a, "scene"_a)
      .def("sync", &sync,
           "Brings the device in step with the scene: uploads and builds what changed since the last sync. Not while "
           "rendering.\n\n"
           "Returns seconds (commit_seconds, upload_seconds, build_seconds, lights_seconds), what the scene holds "
           "(meshes,\n"
           "instances, lights, triangles, materials, images) and what was sent (meshes_uploaded, instances_uploaded,\n"
           "bytes_uploaded).")
      .def(
          "start",
          [](Session& self, const nb::dict& settings) {
            const RenderSettings s = take_settings(settings);
            const WithoutGil release;
            self.start(s);
          },
          "settings"_a,
          "Begins rendering on the core's own thread. `settings`: the members of RenderSettings "
          "(docs/architecture.md); only\n"
          "width and height must be there. ValueError or TypeError names a bad one.")
      .def("wait", &Session::wait, "milliseconds"_a, nb::call_guard<WithoutGil>(),
           "Waits; True when the render has ended.")
      .def("progress", &progress,
           "sample, samples, rays, mrays (million a second), seconds, remaining (below 0: not known), memory (bytes), "
           "stage,\n"
           "finished, cancelled, error.")
      .def("cancel", &Session::cancel, "Asks the render to end soon; what was accumulated stays readable.")
      .def("finish", &Session::finish, nb::call_guard<WithoutGil>(),
           "Waits for the end; raises what ended the render, if an error did.")
      .def("passes", &Session::passes, "[(name, channels)] of the render, in the order asked for.")
      .def("read", &read, "name"_a, "out"_a = nb::none(),
           "Pixels of a pass, averaged over the samples so far: (H, W, C) float32, bottom row first, scene-linear.\n\n"
           "out: an array of this shape to fill and return; None: a new one. May be called while rendering.")
      .def(
          "stats", [](const Session& self) { return nb::module_::import_("json").attr("loads")(self.stats_json()); },
          "Seconds by stage, rays, Mrays/s, memory: a dictionary.");

  m.def("devices", &devices,
        "All Vulkan devices, best first: name, driver, kind, api, memory (bytes), usable, why_not, ray_query, "
        "ray_pipeline,\n"
        "ray_query_why_not, ray_pipeline_why_not (sentences; empty where it is there).\n"
        "Empty when there is no Vulkan loader or driver; Context then says why.");
  m.def("all_passes", &all_passes, "[(name, channels)] of every pass that can be asked for, by Cycles' names.");
  m.def("integrators", &integrator_names, "Names of the integrators.");
  m.def("integrator_table", &integrator_dicts,
        "Every integrator: name, label, description, and parameters with their defaults (those it reads).");
  m.def(
      "reservoir_bytes",
      [](const nb::dict& given) {
        const RenderSettings s = take_settings(given);
        return reservoir_bytes(s.integrator, resolve_reuse(s), s.width, s.height);
      },
      "settings"_a,
      "Bytes that the reservoirs of these settings take (a dictionary as for Session.start). ValueError as there.");
}

}  // namespace hw::python

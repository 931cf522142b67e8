// SPDX-License-Identifier: Apache-2.0
// The Tracer benchmark for `headwater bench-tracer`.
#include "trace/benchmark.h"

#include <nanobind/stl/string.h>

#include "python/bind.h"
#include "python/gil.h"

namespace hw::python {

namespace {

nb::list run(std::uint32_t triangles, std::uint32_t rays, int repeats, const std::string& device,
             const std::string& tracer, int threads) {
  std::vector<TracerBenchRow> rows;
  {
    const WithoutGil release;
    Device own(device, false, threads);
    rows = tracer_benchmark(own, tracer, threads, {{triangles}, rays, repeats});
  }
  nb::list out;
  for (const TracerBenchRow& row : rows) {
    nb::dict d;
    d["triangles"] = row.triangles;
    d["rays"] = row.coherent ? "camera" : "random";
    d["closest"] = row.closest;
    d["plain closest"] = row.plain_closest;
    d["ratio closest"] = row.ratio_closest();
    d["any"] = row.any;
    d["plain any"] = row.plain_any;
    d["ratio any"] = row.ratio_any();
    d["fast closest"] = row.fast_closest;
    d["fast any"] = row.fast_any;
    out.append(d);
  }
  return out;
}

}  // namespace

void bind_benchmark(nb::module_& m) {
  using namespace nb::literals;
  m.def("tracer_benchmark", &run, "triangles"_a, "rays"_a, "repeats"_a, "device"_a = "", "tracer"_a = "auto",
        "threads"_a = 0,
        "Rays a second of a Tracer beside a plain Embree loop on the same rays, triangles and threads.\n\n"
        "One dict for camera rays, one for random rays. Figures are medians of `repeats` turns in Mrays/s: 'closest' "
        "and\n"
        "'any' of the Tracer, 'plain' of a loop over one robust scene, 'fast' of the same without the robust flag.");
}

}  // namespace hw::python

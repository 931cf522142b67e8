// SPDX-License-Identifier: Apache-2.0
// The end of the interpreter: renders are cancelled and threads joined before drivers and libraries are torn down.
// Objects may outlive the interpreter (a module's globals, a daemon thread's frame); their threads must not.
#include <nanobind/nanobind.h>

#include <memory>
#include <mutex>
#include <vector>

#include "python/bind.h"
#include "python/gil.h"
#include "session/session.h"

namespace hw::python {
namespace {

std::mutex& contexts_mutex() {
  static auto* mutex = new std::mutex;  // never destroyed: a context may be made while the process ends
  return *mutex;
}

std::vector<std::weak_ptr<Context>>& contexts() {
  static auto* all = new std::vector<std::weak_ptr<Context>>;
  return *all;
}

void close_all() {
  const WithoutGil release;
  std::vector<std::weak_ptr<Context>> all;
  {
    std::lock_guard lock(contexts_mutex());
    all.swap(contexts());
  }
  for (const std::weak_ptr<Context>& context : all)
    if (const auto alive = context.lock()) alive->close();
}

}  // namespace

void close_at_exit(const std::shared_ptr<Context>& context) {
  std::lock_guard lock(contexts_mutex());
  std::erase_if(contexts(), [](const auto& other) { return other.expired(); });
  contexts().push_back(context);
}

void bind_exit() {
  nb::set_leak_warnings(false);  // what outlives the interpreter is no news to those who quit Blender
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&close_all));
}

}  // namespace hw::python

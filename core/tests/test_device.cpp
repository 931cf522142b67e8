// SPDX-License-Identifier: Apache-2.0
// The device layer: choice and errors, buffers and memory limits, commands, stage times, several devices at once.

#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gpu/device.h"

using namespace hw;

namespace {

std::vector<std::uint32_t> words_of(Device& device, const Buffer& buffer) {
  std::vector<std::uint32_t> words(buffer.bytes() / 4);
  device.read(buffer, 0, std::as_writable_bytes(std::span(words)));
  return words;
}

std::string message_of(const auto& action) {
  try {
    action();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return {};
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("devices: listed best first, chosen by name, index and kind") {
  std::string error;
  const auto devices = list_devices(&error);
  REQUIRE_MESSAGE(!devices.empty(), error);
  CHECK(error.empty());
  CHECK(devices[0].usable);
  CHECK(devices[0].why_not.empty());
  CHECK(!devices[0].driver.empty());
  CHECK(Device().info().name == devices[0].name);
  CHECK(Device("0").info().name == devices[0].name);
  CHECK(Device(devices[0].name.substr(0, 5)).info().name == devices[0].name);
  CHECK(Device(devices[0].kind).info().kind == devices[0].kind);
  const std::string message = message_of([] { Device("Voodoo 2"); });
  CHECK(contains(message, "There is no device \"Voodoo 2\"."));
  CHECK(contains(message, devices[0].name));  // and says which there are
}

TEST_CASE("device: no driver, and drivers that are not there, are sentences") {
  const char* variables[] = {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"};  // the second one's newer, and overrides the first
  std::optional<std::string> kept[2];
  for (int i = 0; i < 2; ++i)
    if (const char* before = std::getenv(variables[i])) kept[i] = before;
  for (const char* nothing : {"/nonexistent/driver.json", "/dev/null"}) {
    for (const char* variable : variables) setenv(variable, nothing, 1);
    std::string error;
    CHECK(list_devices(&error).empty());
    CHECK(contains(error, "mesa-vulkan-drivers"));
    CHECK(contains(message_of([] { Device device; }), "mesa-vulkan-drivers"));
  }
  for (int i = 0; i < 2; ++i) kept[i] ? setenv(variables[i], kept[i]->c_str(), 1) : unsetenv(variables[i]);
  CHECK(!list_devices().empty());
}

TEST_CASE("validation: a wrong call is counted and logged") {
  const char* before = std::getenv("HEADWATER_VALIDATION_LOG");
  const std::string kept = before ? before : "";
  const std::filesystem::path log =
      std::filesystem::temp_directory_path() / ("headwater-validation-" + std::to_string(getpid()));
  setenv("HEADWATER_VALIDATION_LOG", log.c_str(), 1);
  {
    Device device({}, true);
    VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    create.size = 16;  // and no usage, which the specification forbids
    VkBuffer buffer = VK_NULL_HANDLE;
    if (device.vk().vkCreateBuffer(device.handle(), &create, nullptr, &buffer) == VK_SUCCESS)
      device.vk().vkDestroyBuffer(device.handle(), buffer, nullptr);
    CHECK(device.validation_messages() == 1);
  }
  before ? setenv("HEADWATER_VALIDATION_LOG", kept.c_str(), 1) : unsetenv("HEADWATER_VALIDATION_LOG");
  std::ifstream stream(log);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  CHECK(contains(text, "VkBufferCreateInfo"));
  std::filesystem::remove(log);
}

TEST_CASE("device: threads are for that device alone") {
  unsetenv("LP_NUM_THREADS");
  Device one({}, false, 1);
  CHECK(std::getenv("LP_NUM_THREADS") == nullptr);
  setenv("LP_NUM_THREADS", "2", 1);
  Device other({}, false, 1);
  CHECK(std::string(std::getenv("LP_NUM_THREADS")) == "2");
  unsetenv("LP_NUM_THREADS");
}

TEST_CASE("buffers: written, read, filled and copied; addresses apart; validation silent") {
  Device device({}, true);
  {
    std::vector<std::uint32_t> data(1000);
    for (std::uint32_t i = 0; i < 1000; ++i) data[i] = i * i;
    const auto a = device.upload(std::as_bytes(std::span(data)), "squares");
    Buffer b(device, 4000, BufferUse::readback, "copy"), c(device, 64, BufferUse::upload, "small"),
        empty(device, 0, BufferUse::device, "empty");
    CHECK(words_of(device, *a) == data);
    CHECK(b.mapped() != nullptr);
    CHECK(c.mapped() != nullptr);
    CHECK((a->mapped() != nullptr) == device.shared_memory());
    CHECK(empty.address() != 0);
    CHECK(a->address() % 256 == 0);
    CHECK((a->address() + a->bytes() <= c.address() || c.address() + c.bytes() <= a->address()));
    Commands commands(device);
    commands.copy(*a, 0, b, 0, 4000);
    commands.fill(b, 400, 40, 0xABCD);  // after the copy: barriers are implied
    commands.copy(b, 396, b, 2000, 8);
    commands.flush();
    commands.flush();  // nothing to do
    CHECK(b.as<std::uint32_t>()[99] == 99 * 99);
    CHECK(b.as<std::uint32_t>()[100] == 0xABCD);
    CHECK(b.as<std::uint32_t>()[109] == 0xABCD);
    CHECK(b.as<std::uint32_t>()[110] == 110 * 110);
    CHECK(b.as<std::uint32_t>()[501] == 0xABCD);
    CHECK(contains(message_of([&] { device.write(c, 60, std::as_bytes(std::span(data))); }), "past the end"));
  }
  CHECK(device.bytes_in_use() == 0);
  CHECK(device.peak_bytes() >= 8000);
  CHECK(device.validation_messages() == 0);
}

TEST_CASE("buffers: many small ones come and go without loss") {
  Device device({}, true);
  std::vector<std::unique_ptr<Buffer>> buffers;
  std::vector<std::uint32_t> tags;
  std::uint32_t state = 1;
  for (int step = 0; step < 6000; ++step) {
    state = state * 1664525u + 1013904223u;
    if (buffers.size() < 40 || state >> 31) {
      const std::size_t bytes = 4 + (state >> 8) % 200'000;
      buffers.push_back(std::make_unique<Buffer>(device, bytes, BufferUse::upload, "b"));
      tags.push_back(state);
      std::memcpy(buffers.back()->as<std::byte>(), &state, 4);
      std::memcpy(buffers.back()->as<std::byte>() + bytes - 4, &state, 4);
    } else {
      const std::size_t k = (state >> 8) % buffers.size();
      std::uint32_t first, last;
      std::memcpy(&first, buffers[k]->as<std::byte>(), 4);
      std::memcpy(&last, buffers[k]->as<std::byte>() + buffers[k]->bytes() - 4, 4);
      if (buffers[k]->bytes() >= 8) REQUIRE(first == tags[k]);
      REQUIRE(last == tags[k]);
      buffers.erase(buffers.begin() + static_cast<std::ptrdiff_t>(k));
      tags.erase(tags.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
  buffers.clear();
  CHECK(device.bytes_in_use() == 0);
  CHECK(device.validation_messages() == 0);
}

TEST_CASE("out of memory: a limit set low, and more than the machine has") {
  Device device;
  device.set_memory_limit(1 << 20);
  Buffer fits(device, 600'000, BufferUse::device, "fits");
  const std::string limited = message_of([&] { Buffer(device, 600'000, BufferUse::device, "texture of the wall"); });
  CHECK(contains(limited, "texture of the wall"));
  CHECK(contains(limited, "1.0 MiB"));
  CHECK_THROWS_AS(Buffer(device, 600'000, BufferUse::device, "too much"), OutOfMemory);
  device.set_memory_limit(0);
  Buffer now(device, 600'000, BufferUse::device, "fits without the limit");
  const std::string huge = message_of([&] { Buffer(device, std::size_t{1} << 46, BufferUse::device, "64 TiB"); });
  CHECK(contains(huge, "64"));
  CHECK_THROWS_AS(Buffer(device, std::size_t{1} << 46, BufferUse::device, "64 TiB"), OutOfMemory);
  CHECK(device.bytes_in_use() < 2'000'000);
}

TEST_CASE("kernels: an unknown name, and too many groups, are errors by name") {
  Device device;
  CHECK(message_of([&] { Kernel(device, "teapot"); }) == "There is no kernel named \"teapot\".");
  Kernel kernel(device, "queue_prepare");
  CHECK(kernel.name() == "queue_prepare");
  Commands commands(device);
  std::byte push[132] = {};
  CHECK(contains(message_of([&] { commands.dispatch(kernel, push, 1); }), "128 bytes"));
  if (device.max_groups() != ~0u)
    CHECK(contains(message_of([&] { commands.dispatch(kernel, {}, device.max_groups() + 1); }), "workgroups"));
}

TEST_CASE("stage times: by name, on the device and from the host") {
  Device device;
  Buffer buffer(device, 16 << 20, BufferUse::device, "filled");
  Commands commands(device);
  commands.fill(buffer, 0, buffer.bytes(), 0);  // the first touch is slow
  commands.flush();
  for (int i = 0; i < 3; ++i) {
    commands.begin_stage("one");
    commands.fill(buffer, 0, buffer.bytes(), 1);
    commands.begin_stage("forty");
    for (int k = 0; k < 40; ++k) commands.fill(buffer, 0, buffer.bytes(), 2);
    commands.flush();
  }
  device.add_stage_time("host", 0.25);
  double one = 0, forty = 0, host = 0;
  for (const StageTime& stage : device.stage_times()) {
    CHECK(stage.calls == (stage.name == "host" ? 1 : 3));
    if (stage.name == "one") one = stage.seconds;
    if (stage.name == "forty") forty = stage.seconds;
    if (stage.name == "host") host = stage.seconds;
  }
  CHECK(one > 0);
  CHECK(forty > one);
  CHECK(host == 0.25);
  device.reset_stage_times();
  CHECK(device.stage_times().empty());
  device.set_stage_timing(false);
  commands.begin_stage("off");
  commands.fill(buffer, 0, 4096, 1);
  commands.flush();
  CHECK(device.stage_times().empty());
}

TEST_CASE("devices: several in one process, one of them with validation, on threads") {
  Device first, second({}, true);
  std::vector<std::thread> threads;
  int wrong[2] = {0, 0};
  for (int k = 0; k < 2; ++k)
    threads.emplace_back([&, k] {
      Device& device = k ? second : first;
      Commands commands(device);
      Buffer buffer(device, 4096, BufferUse::device, "b");
      for (std::uint32_t i = 0; i < 50; ++i) {
        commands.fill(buffer, 0, 4096, i + 100 * static_cast<std::uint32_t>(k));
        commands.flush();
        wrong[k] += words_of(device, buffer)[1000] != i + 100 * static_cast<std::uint32_t>(k);
      }
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(wrong[0] == 0);
  CHECK(wrong[1] == 0);
  CHECK(second.validation_messages() == 0);
  { Device third({}, true); }  // comes and goes while the others live
  Commands commands(first);
  Buffer buffer(first, 64, BufferUse::device, "b");
  commands.fill(buffer, 0, 64, 5);
  commands.flush();
  CHECK(words_of(first, buffer)[3] == 5);
}

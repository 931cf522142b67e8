// SPDX-License-Identifier: Apache-2.0
// A session under many hands: pixels read while renders of other sizes begin, and a context that is closed.
#include <doctest/doctest.h>

#include <stdexcept>
#include <thread>

#include "session/session.h"

using namespace hw;

namespace {

std::shared_ptr<Scene> sky_scene() {
  auto scene = std::make_shared<Scene>();
  WorldData world;
  world.name = "sky";
  world.color = {1, 1, 1};
  scene->set_world(world);
  CameraData camera{};
  camera.camera_to_world[0] = camera.camera_to_world[5] = camera.camera_to_world[10] = 1;
  camera.left = camera.bottom = -1, camera.right = camera.top = 1;
  camera.type = HW_CAMERA_PERSPECTIVE;
  camera.clip_start = 0.1f, camera.clip_end = 100;
  camera.focus_distance = camera.aperture_ratio = 1;
  scene->set_camera(camera);
  return scene;
}

RenderSettings settings(std::uint32_t size, std::uint32_t samples) {
  RenderSettings s;
  s.width = s.height = size;
  s.samples = samples;
  return s;
}

}  // namespace

TEST_CASE("pixels are read whole or not at all while renders of other sizes begin") {
  auto context = make_context("", "auto", 0, true);
  Session session(context, sky_scene());
  session.sync();
  std::atomic<bool> over{false};
  std::atomic<int> read{0}, refused{0};
  std::thread reader([&] {
    std::vector<float> pixels;
    while (!over) try {
        std::uint32_t width = 0, height = 0;
        session.size(width, height);
        pixels.assign(std::size_t(width) * height * 4, -1.0f);
        session.read("Combined", pixels.data(), pixels.size());
        (void)session.stats_json();
        ++read;
      } catch (const std::logic_error&) {
        ++refused;
      }
  });
  for (std::uint32_t i = 0; i < 40; ++i) {
    session.start(settings(i % 2 ? 8 : 200, 2));
    if (i % 3 == 0) session.cancel();
    session.finish();
  }
  over = true;
  reader.join();
  CHECK(read > 0);
  std::vector<float> wrong(3);
  CHECK_THROWS_AS(session.read("Combined", wrong.data(), wrong.size()), std::logic_error);
}

TEST_CASE("a context that is closed ends its render and begins no other") {
  auto context = make_context("", "auto", 0, true);
  Session session(context, sky_scene());
  session.sync();
  session.start(settings(64, 1u << 30));
  Session other(context, sky_scene());
  CHECK_THROWS_AS(other.sync(), std::logic_error);
  context->close();
  CHECK(session.wait(0));
  CHECK(session.progress().cancelled);
  CHECK_THROWS_WITH_AS(other.sync(), "the process is ending: nothing is rendered any more", std::logic_error);
  CHECK_THROWS_AS(session.start(settings(64, 1)), std::logic_error);
}

TEST_CASE("a picture goes on where it ended, to the same bits, beside another session's") {
  auto context = make_context("", "auto", 0, true);
  Session session(context, sky_scene()), other(context, sky_scene());
  session.sync();
  const auto pixels_of = [](Session& s, std::uint32_t size) {
    std::vector<float> pixels(std::size_t(size) * size * 4);
    s.read("Combined", pixels.data(), pixels.size());
    return pixels;
  };
  const auto render = [](Session& s, RenderSettings settings) {
    s.start(settings);
    s.finish();
  };
  render(session, settings(16, 7));
  const std::vector<float> whole = pixels_of(session, 16);

  RenderSettings part = settings(16, 2);
  render(session, part);
  other.sync();  // takes nothing from the first session
  render(other, settings(16, 3));
  part.resume = true, part.samples = 7;
  render(session, part);
  CHECK(session.progress().sample == 7);
  CHECK(pixels_of(session, 16) == whole);

  SUBCASE("but only when there is one") {
    CHECK_THROWS_AS(session.start(part), std::logic_error);  // it has its samples
    part.samples = 9;
    part.width = part.height = 17;
    CHECK_THROWS_AS(session.start(part), std::logic_error);
    part.width = part.height = 16;
    part.passes = {"Combined", "Depth"};
    CHECK_THROWS_AS(session.start(part), std::logic_error);
    Session fresh(context, sky_scene());
    fresh.sync();
    part.passes = {"Combined"};
    CHECK_THROWS_AS(fresh.start(part), std::logic_error);
    CHECK_NOTHROW(render(session, part));  // what was refused did no harm
  }
}

# SPDX-License-Identifier: Apache-2.0
"""Denoised pictures of whole renders: add-on, command line, a viewport's worker; and without the library."""

import numpy as np
import pytest
from bpy_process import run
from cli_process import finish

from headwater import denoiser
from headwater.image_io import read_exr

pytest.importorskip("bpy")

FORMAT = """
if hasattr(scene.render.image_settings, "media_type"):
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
scene.render.resolution_x, scene.render.resolution_y = 96, 64
own = scene.headwater
"""
ROOM = """
scene.render.film_transparent = True
bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -1))
bpy.data.worlds[0].color = (0.3, 0.4, 0.6)
"""
WITHOUT_LIBRARY = """
from headwater import denoiser
denoiser._candidates = lambda library: iter(["/nowhere/" + denoiser.SONAME])
"""


@pytest.fixture(scope="module")
def oidn():
    missing = denoiser.unavailable()
    if missing:
        pytest.skip(missing)


def layers(path) -> dict:
    """Arrays by pass, of the one view layer."""
    return {name.removeprefix("ViewLayer."): pixels for name, pixels in read_exr(str(path)).layers.items()}


def rendered(tmp_path) -> dict:
    """Pictures by the name their script gave them."""
    return {path.name.removesuffix(".exr"): layers(path) for path in tmp_path.glob("*.exr")}


RENDER = """
def render(name):
    scene.render.filepath = f"{tmp}/{name}.exr"
    bpy.ops.render.render(write_still=True)
"""


def relmse(picture, reference) -> float:
    picture, reference = picture[..., :3], reference[..., :3]
    return float(np.mean((picture - reference) ** 2 / (reference**2 + 1e-2)))


def test_noisy_image_is_kept_to_the_bit_and_the_error_falls(core, oidn, tmp_path):
    run(
        FORMAT
        + ROOM
        + RENDER
        + """
own.samples = 256
render("reference")
own.samples = 4
render("noisy")
own.use_denoising = True
render("denoised")
own.denoising_input_passes = "RGB"
render("alone")
assert not hb.last_error()
""",
        tmp_path,
        fake=False,
        timeout=400,
    )
    pictures = rendered(tmp_path)
    reference, noisy = pictures["reference"]["Combined"], pictures["noisy"]["Combined"]
    assert set(pictures["noisy"]) == {"Combined"}
    assert set(pictures["denoised"]) == {"Combined", "Noisy Image"}, "guides are no passes of the picture"
    for name in ("denoised", "alone"):
        assert np.array_equal(pictures[name]["Noisy Image"], noisy), "noisy picture kept to the bit"
        picture = pictures[name]["Combined"]
        assert np.array_equal(picture[..., 3], noisy[..., 3]), "alpha kept"
        assert relmse(picture, reference) * 3 < relmse(noisy, reference)
        assert picture[..., :3].mean() == pytest.approx(noisy[..., :3].mean(), rel=0.05)
    assert not np.array_equal(pictures["alone"]["Combined"], pictures["denoised"]["Combined"]), "guides count"


def test_cycles_settings_decide_where_they_are_in_use(tmp_path):
    facts = run(
        """
        from headwater_addon import denoising, options, passes
        own, cycles, layer = scene.headwater, scene.cycles, scene.view_layers[0]
        given = options.Options()
        def asked():
            found = denoising.recipe(scene, layer, given)
            noisy = "Noisy Image" in [item.name for item in passes.wanted(scene, layer, given)]
            assert noisy == (found is not None)
            return found and [found.input_passes, found.prefilter, found.quality]
        ours = asked()
        own.use_cycles_settings = True
        cycles.use_denoising, cycles.denoising_prefilter, cycles.denoising_quality = True, "FAST", "BALANCED"
        theirs = asked()
        layer.cycles.use_denoising = False
        layer_off = asked()
        given.denoise = True
        forced = asked()
        cycles.use_preview_denoising, cycles.preview_denoising_start_sample = True, 7
        show(ours=ours, theirs=theirs, layer_off=layer_off, forced=forced, start=denoising.viewport_recipe(scene)[1])
        """,
        tmp_path,
    )
    assert facts["ours"] is None and facts["layer_off"] is None
    assert facts["theirs"] == facts["forced"] == ["RGB_ALBEDO_NORMAL", "FAST", "BALANCED"]
    assert facts["start"] == 7


def test_absent_library_is_one_warning_and_the_noisy_picture(tmp_path):
    facts = run(
        FORMAT
        + RENDER
        + WITHOUT_LIBRARY
        + """
render("noisy")
own.use_denoising = True
render("asked")
show(error=hb.last_error())
""",
        tmp_path,
    )
    pictures = rendered(tmp_path)
    said = [line for line in facts["stdout"].splitlines() if "denoise" in line]
    assert len(said) == 1 and facts["error"] == ""
    assert (
        "Warning: Headwater: not denoised: Open Image Denoise is not here" in said[0]
        and "pip install pyoidn" in said[0]
    )
    noisy = pictures["noisy"]["Combined"]
    assert np.array_equal(pictures["asked"]["Combined"], noisy)
    assert np.array_equal(pictures["asked"]["Noisy Image"], noisy)


@pytest.mark.alone
def test_escape_while_denoising_keeps_the_noisy_picture(oidn, tmp_path):
    facts = run(
        FORMAT
        + RENDER
        + """
import time
from headwater_addon import denoising
own.use_denoising = True
scene.render.resolution_x, scene.render.resolution_y = 1280, 720
run_, waited = denoising.run, []
def escaped(recipe, read, cancelled):
    begun = time.perf_counter()
    try:
        return run_(recipe, read, lambda: True)
    finally:
        waited.append(time.perf_counter() - begun)
denoising.run = escaped
render("escaped")
show(error=hb.last_error(), waited=waited)
""",
        tmp_path,
    )
    picture = rendered(tmp_path)["escaped"]
    assert facts["error"] == "" and len(facts["waited"]) == 1
    assert np.array_equal(picture["Combined"], picture["Noisy Image"])


def test_error_while_denoising_keeps_the_noisy_picture(oidn, tmp_path):
    facts = run(
        FORMAT
        + RENDER
        + """
from headwater import denoiser
own.use_denoising = True
def broken(*_, **__): raise RuntimeError("Open Image Denoise: out of memory")
denoiser.denoise = broken
render("broken")
show(error=hb.last_error())
""",
        tmp_path,
    )
    picture = rendered(tmp_path)["broken"]
    assert facts["error"] == "" and "not denoised: Open Image Denoise: out of memory" in facts["stdout"]
    assert np.array_equal(picture["Combined"], picture["Noisy Image"])


USD = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 1
)
def Camera "Eye"
{
    double3 xformOp:translate = (0, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "Ball"
{
    color3f[] primvars:displayColor = [(0.8, 0.3, 0.2)]
}
def SphereLight "Lamp"
{
    float inputs:radius = 1
    float inputs:intensity = 30
    double3 xformOp:translate = (3, 2, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def test_command_line_denoises_usd_and_keeps_the_noisy_picture(core, oidn, tmp_path):
    stage = tmp_path / "ball.usda"
    stage.write_text(USD)
    for name, extra in (("plain", ()), ("denoised", ("--denoise",))):
        status, _, err = finish(
            stage, "-o", tmp_path / f"{name}.exr", "--size", "64x48", "--samples", "2", "--quiet", *extra
        )
        assert status == 0, err
    plain, denoised = layers(tmp_path / "plain.exr"), layers(tmp_path / "denoised.exr")
    noisy = next(iter(plain.values()))
    assert np.array_equal(denoised["Noisy Image"], noisy)
    assert not np.array_equal(denoised["Combined"], noisy)


def test_command_line_denoises_blend_files_only_when_asked(core, oidn, tmp_path):
    run(
        "scene.headwater.use_cycles_settings = scene.cycles.use_denoising = True\n"
        "bpy.ops.wm.save_as_mainfile(filepath=tmp + '/file.blend')",
        tmp_path,
    )
    for name, extra in (("plain", ()), ("denoised", ("--denoise",))):
        status, _, err = finish(
            tmp_path / "file.blend",
            "-o",
            tmp_path / f"{name}.exr",
            "--size",
            "48x32",
            "--samples",
            "2",
            "--quiet",
            *extra,
        )
        assert status == 0, err
    plain, denoised = layers(tmp_path / "plain.exr"), layers(tmp_path / "denoised.exr")
    assert len(plain) == 1 and set(denoised) == {"Combined", "Noisy Image"}
    assert np.array_equal(denoised["Noisy Image"], next(iter(plain.values())))
    assert not np.array_equal(denoised["Combined"], denoised["Noisy Image"])


WORKER = """
import threading, time
from headwater_addon.viewport import worker as module
from headwater_addon.viewport.camera import ViewCamera
from headwater import denoiser

class Engine:
    def tag_redraw(self): pass

engine, shown = Engine(), []
def request(**changes):
    plain = dict(
        edition=1, frame=1.0, width=96, height=64, region=(0, 0, 96, 64),
        camera=ViewCamera("perspective", np.eye(3, 4, dtype=np.float32).tobytes(), (-1, 1, -1, 1),
                          (("clip", (0.1, 100.0)),)),
        settings=(("integrator", "path"), ("passes", ("Combined", "Denoising Albedo"))), samples=8, channel="Combined",
        carried=False, device=("", "auto", 0), denoise=denoiser.Recipe("RGB_ALBEDO", "FAST", "FAST"), denoise_from=1,
    )
    return module.Request(**(plain | changes))

worker = module.Worker(core.Scene(), engine)
show_ = worker._show
def showing(request, slice_, pixels, denoised=False):
    shown.append([slice_.samples, denoised, request.edition])
    show_(request, slice_, pixels, denoised)
worker._show = showing

def wait_for(done, seconds=20.0):
    end = time.perf_counter() + seconds
    while not done():
        worker.seen()
        assert time.perf_counter() < end, (shown, worker.error, worker.not_denoised)
        time.sleep(0.01)

def finished(asked):
    picture = worker.picture
    return worker.state == "Done" and picture is not None and picture.request == asked and picture.samples == 8
"""


def test_viewport_shows_its_last_picture_denoised(oidn, tmp_path):
    facts = run(
        WORKER
        + """
first = request()
worker.ask(first)
wait_for(lambda: finished(first) and worker.picture.denoised)
pixels = worker.picture.pixels
noise = core.sessions[-1].read("Combined")
tried, denoise_ = [], worker._denoise
worker._denoise = lambda request, *rest: (tried.append(request.edition), denoise_(request, *rest))
late = request(edition=2, denoise_from=9)
worker.ask(late)
wait_for(lambda: finished(late))
worker.close(); worker.join(10.0)
show(alpha=bool((pixels[..., 3] == noise[..., 3]).all()), same=bool((pixels == noise).all()), tried=tried,
     shape=pixels.shape, last=[each for each in shown if each[2] == 1][-1])
""",
        tmp_path,
    )
    assert facts["shape"] == [64, 96, 4] and facts["alpha"] and not facts["same"]
    assert facts["last"] == [8, True, 1]
    assert facts["tried"] == [], "not before the start sample"


def test_viewport_denoises_coarse_pictures_that_take_no_time(oidn, tmp_path):
    facts = run(
        WORKER
        + """
from headwater_addon.viewport.refinement import Slice
coarse, seen, show_slice = Slice(4, 1, False, True), [], worker._show
worker._show = lambda request, slice_, pixels, denoised=False: seen.append([slice_.divider, denoised])
asked = request()
passes = {name: np.random.default_rng(1).random((16, 24, n), np.float32)
          for name, n in (("Combined", 4), ("Denoising Albedo", 3))}
due = worker._denoising_due(asked, coarse)
worker._denoise_coarse(asked, passes, coarse)
worker._coarse_rate = 1.0
slow = worker._denoising_due(asked, coarse)
worker.close(); worker.join(10.0)
show(due=due, slow=slow, seen=seen)
""",
        tmp_path,
    )
    assert facts["due"] and not facts["slow"] and facts["seen"] == [[4, True]]


def test_viewport_leaves_denoising_for_a_newer_request(oidn, tmp_path):
    facts = run(
        WORKER
        + """
begun, ended = threading.Event(), []
def slow(*_, cancelled, **__):
    begun.set()
    end = time.perf_counter() + 20
    while time.perf_counter() < end:
        if cancelled():
            ended.append("cancelled")
            raise denoiser.DenoiseCancelled
        time.sleep(0.005)
    raise RuntimeError("never told to stop")
denoiser.denoise = slow
worker.ask(request())
assert begun.wait(10)
newer = request(edition=2, denoise=None)
worker.ask(newer)
wait_for(lambda: finished(newer), 10)
worker.close(); worker.join(10.0)
show(ended=ended, problem=worker.not_denoised)
""",
        tmp_path,
    )
    assert facts["ended"] == ["cancelled"] and facts["problem"] == ""


def test_viewport_without_the_library_stays_noisy_and_says_so(tmp_path):
    facts = run(
        WITHOUT_LIBRARY
        + WORKER
        + """
asked = request()
worker.ask(asked)
wait_for(lambda: finished(asked) and worker.not_denoised)
worker.close(); worker.join(10.0)
show(why=worker.not_denoised, denoised=worker.picture.denoised, error=worker.error)
""",
        tmp_path,
    )
    assert "Open Image Denoise is not here" in facts["why"]
    assert facts["denoised"] is False and facts["error"] == ""

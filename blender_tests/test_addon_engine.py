# SPDX-License-Identifier: Apache-2.0
"""The add-on's render engine in bpy, with the core replaced by a fake: registration, passes, border, frames, errors."""

import json

import numpy as np
import pytest
from bpy_process import run

OpenEXR = pytest.importorskip("OpenEXR")
bpy = pytest.importorskip("bpy")


def set_format(multilayer: bool) -> str:
    if multilayer:
        # 5.0 asks for the media type first.
        return """
if hasattr(scene.render.image_settings, "media_type"):
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
"""
    return """
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
"""


def read_exr(path) -> dict[str, np.ndarray]:
    """Channels by name, top row first, of all parts."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}


def test_engine_is_in_the_dropdown_and_comes_back_after_unregister(tmp_path):
    facts = run(
        """
        def there():
            return any(
                getattr(c, "bl_idname", "") == "HEADWATER" and c.is_registered
                for c in bpy.types.RenderEngine.__subclasses__()
            )
        panel = bpy.types.RENDER_PT_output if hasattr(bpy.types, "RENDER_PT_output") else bpy.types.RENDER_PT_format
        first = [there(), "HEADWATER" in panel.COMPAT_ENGINES, hasattr(bpy.types.Scene, "headwater"),
                 len(bpy.app.handlers.render_complete)]
        hb.unregister()
        gone = [hasattr(bpy.types, "HEADWATER_RENDER_PT_sampling"), "HEADWATER" in panel.COMPAT_ENGINES,
                hasattr(bpy.types.Scene, "headwater"), len(bpy.app.handlers.render_complete)]
        hb.register()
        again = [there(), "HEADWATER" in panel.COMPAT_ENGINES, hasattr(bpy.types.Scene, "headwater"),
                 len(bpy.app.handlers.render_complete)]
        scene.render.engine = "HEADWATER"
        bpy.ops.render.render()
        show(first=first, gone=gone, again=again, engine=scene.render.engine, error=hb.last_error(),
             prefs="headwater_addon" in bpy.context.preferences.addons)
        """,
        tmp_path,
    )
    assert facts["first"][:3] == [True, True, True]
    assert facts["gone"] == [False, False, False, facts["first"][3] - 1]
    assert facts["again"] == facts["first"]
    assert facts["engine"] == "HEADWATER" and facts["error"] == "" and facts["prefs"]


def test_panels_are_compatible_and_draw_for_every_kind_of_data(tmp_path):
    """Properties that panels show must exist: a layout that is drawn off screen would hide a misspelt name."""
    facts = run(
        """
        import ast, inspect
        shown, missing = 0, []
        class Row:
            def __getattr__(self, name):
                return lambda *a, **k: Row()
            def prop(self, data, name, **k):
                global shown
                shown += 1
                if name not in data.bl_rna.properties: missing.append(f"{type(data).__name__}.{name}")
        for attribute in ("use_property_split", "use_property_decorate", "active", "enabled", "alert", "scale_y"):
            setattr(Row, attribute, False)
        lights = [bpy.data.lights.new(kind, kind) for kind in ("POINT", "SPOT", "SUN", "AREA")]
        world = bpy.data.worlds[0]
        class Context:
            engine = "HEADWATER"; mode = "OBJECT"
            scene = bpy.context.scene; view_layer = bpy.context.view_layer; world = world
            camera = bpy.data.cameras[0]; object = bpy.data.objects["Cube"]
            material = bpy.data.materials[0]; material_slot = bpy.data.objects["Cube"].material_slots[0]
            space_data = None; light = None; preferences = bpy.context.preferences
            window_manager = bpy.context.window_manager; region = type("Region", (), {"width": 300})
        hb_log = __import__("headwater_addon.log", fromlist=["log"])
        for number in range(30):
            hb_log.log.add("ERROR", f"Object 'Cube': {number} is a text of more than one line " * 3, "Object", "Cube")
            hb_log.log.add("WARNING", f"{number} about nothing that has a name")
        bpy.ops.render.render()
        ours = [c for c in bpy.types.Panel.__subclasses__() if c.__module__.startswith("headwater_addon.ui")]
        for cycles in (True, False):
            scene.headwater.use_cycles_settings = cycles
            for light in lights:
                Context.light = light
                for panel in ours:
                    if panel.poll(Context) if hasattr(panel, "poll") else True:
                        if "draw" in panel.__dict__:
                            fake = type("P", (), {"layout": Row()})()
                            panel.draw(fake, Context)
        show(count=len(ours), shown=shown, missing=missing)
        """,
        tmp_path,
    )
    assert facts["missing"] == []
    assert facts["count"] > 20 and facts["shown"] > 100


def test_default_cube_to_exr_keeps_pixels_and_orientation(tmp_path):
    run(set_format(False) + "bpy.ops.render.render(write_still=True)", tmp_path)
    pixels = read_exr(next(tmp_path.glob("frame_*.exr")))
    red, green = (pixels[name] for name in ("R", "G"))
    assert red.shape == (24, 32)
    np.testing.assert_allclose(red[0], np.arange(32) / 1000, atol=1e-6)
    np.testing.assert_allclose(green[:, 0], np.arange(24)[::-1] / 1000, atol=1e-6)  # EXR's first row is the top


def test_all_passes_have_cycles_names_and_channels(tmp_path):
    code = """
        names = [p.identifier for p in bpy.types.ViewLayer.bl_rna.properties if p.identifier.startswith("use_pass_")]
        layer = scene.view_layers[0]
        skip = ("cryptomatte", "subsurface", "shadow", "ambient", "grease", "accurate")
        for name in names:
            if not any(word in name for word in skip):
                setattr(layer, name, True)
        layer.cycles.denoising_store_passes = True
        {format}
        scene.render.engine = "HEADWATER"
        bpy.ops.render.render(write_still=True)
        picture, to_next = core.sessions[-1].settings  # motion to the next frame is a pass of its own
        show(settings=picture["passes"], motion=to_next["passes"])
        """
    indented = set_format(True).strip().replace("\n", "\n        ")
    facts = run(code.format(format=indented), tmp_path)
    channels = set(read_exr(next(tmp_path.glob("frame_*.exr"))))
    import fake_core

    ids = {"Depth": "Z", "Mist": "Z", "Position": "XYZ", "Normal": "XYZ", "Vector": "XYZW", "UV": "UVA",
           "Object Index": "X", "Material Index": "X", "Denoising Normal": "XYZ", "Denoising Depth": "Z",
           "Combined": "RGBA"}  # fmt: skip
    names = {name: name for name in fake_core.PASSES}
    if bpy.app.version < (5, 0, 0):
        kinds = {"Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans"}
        parts = {"Direct": "Dir", "Indirect": "Ind", "Color": "Col"}
        names |= {f"{kind} {part}": kinds[kind] + parts[part] for kind in kinds for part in parts}
        names |= {"Object Index": "IndexOB", "Material Index": "IndexMA", "Emission": "Emit", "Environment": "Env"}
    wanted = {f"ViewLayer.{names[name]}.{c}" for name in fake_core.PASSES for c in ids.get(name, "RGB")}
    assert wanted <= channels, sorted(wanted - channels)
    assert set(facts["settings"]) == set(fake_core.PASSES)
    assert facts["motion"] == ["Vector"]


def test_pass_pixels_land_in_their_own_channels(tmp_path):
    code = "scene.view_layers[0].use_pass_vector = scene.view_layers[0].use_pass_mist = True\n" + set_format(True)
    run(code + "bpy.ops.render.render(write_still=True)", tmp_path)
    import fake_core

    pixels = read_exr(next(tmp_path.glob("frame_*.exr")))
    order = list(fake_core.PASSES).index("Vector")
    # Z and W are X and Y of the motion to the next frame, the other way round.
    for channel, value in zip("XYZW", (0.1, 0.2, -0.1, -0.2), strict=True):
        expected = np.copysign(order, value) + value
        np.testing.assert_allclose(pixels[f"ViewLayer.Vector.{channel}"], expected, rtol=1e-6)
    order = list(fake_core.PASSES).index("Mist")
    np.testing.assert_allclose(pixels["ViewLayer.Mist.Z"], order + 0.1, rtol=1e-6)


@pytest.mark.parametrize("crop", [False, True])
def test_border_and_crop(tmp_path, crop):
    facts = run(
        set_format(False)
        + f"""
scene.render.use_border, scene.render.use_crop_to_border = True, {crop}
scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
bpy.ops.render.render(write_still=True)
s = core.sessions[-1]
show(settings=s.settings[-1], plane=s.scene.camera["plane"])
""",
        tmp_path,
    )
    assert facts["settings"]["region"] == [8, 12, 24, 24]
    assert (facts["settings"]["width"], facts["settings"]["height"]) == (32, 24)
    left, right, bottom, top = facts["plane"]
    assert right == pytest.approx(-left) and (right - left) / (top - bottom) == pytest.approx(32 / 24)
    red = read_exr(next(tmp_path.glob("frame_*.exr")))["R"]
    if crop:
        assert red.shape == (12, 16)
        np.testing.assert_allclose(red[3], np.arange(8, 24) / 1000, atol=1e-6)
    else:
        assert red.shape == (24, 32)
        np.testing.assert_allclose(red[3, 8:24], np.arange(8, 24) / 1000, atol=1e-6)
        assert not red[:, :8].any() and not red[12:].any()


@pytest.mark.parametrize("persistent", [False, True])
def test_animation_keeps_the_scene_and_sends_only_what_moved(tmp_path, persistent):
    facts = run(
        f"""
        cube = bpy.data.objects["Cube"]
        cube.keyframe_insert("location", frame=1)
        cube.location.x = 1
        cube.keyframe_insert("location", frame=5)
        scene.frame_start, scene.frame_end = 1, 3
        scene.render.use_persistent_data = {persistent}
        bpy.ops.render.render(animation=True)
        session = core.sessions[-1]
        places = [i["matrix"][0][3] for i in session.scene.instances.values()]
        show(sessions=len(core.sessions), edits=session.edits, x=places)
        bpy.ops.render.render()
        show(after=len(core.sessions), error=hb.last_error())
        """,
        tmp_path,
    )
    assert facts["sessions"] == 1
    first, second, third = facts["edits"]
    assert {"mesh", "instance", "light", "material", "camera", "world"} <= {name for name, _ in first}
    assert [name for name, _ in second] == ["instance"] and [name for name, _ in third] == ["instance"]
    assert float(facts["x"][0]) > 0.2
    assert facts["after"] == (1 if persistent else 2)
    assert facts["error"] == ""
    assert len(list(tmp_path.glob("frame_*.png"))) == 3


def test_edits_between_renders_reach_a_persistent_scene(tmp_path):
    facts = run(
        """
        scene.render.use_persistent_data = True
        cube = bpy.data.objects["Cube"]
        def edits():
            bpy.ops.render.render()
            return [name for name, _ in core.sessions[-1].edits[-1]]
        result = {"first": edits(), "nothing": edits()}
        cube.data.vertices[0].co.z += 1
        cube.data.update()
        result["mesh"] = edits()
        bpy.context.evaluated_depsgraph_get()  # another graph takes its own notice of the next change
        cube.data.vertices[0].co.z += 1
        cube.data.update()
        bpy.context.view_layer.update()
        result["again"] = edits()
        bpy.data.objects.remove(cube)
        result["removed"] = edits()
        show(sessions=len(core.sessions), **result)
        """,
        tmp_path,
    )
    assert facts["sessions"] == 1
    assert "mesh" in facts["first"] and facts["nothing"] == []
    assert facts["mesh"] == ["mesh"] and facts["again"] == ["mesh"]
    assert facts["removed"][:2] == ["remove_instances", "remove_mesh"]


def test_view_layers_render_apart_with_holdout_indirect_only_and_override(tmp_path):
    facts = run(
        """
        for name, x in (("H", 3), ("I", 6)):
            collection = bpy.data.collections.new(name)
            scene.collection.children.link(collection)
            obj = bpy.data.objects.new(name, bpy.data.meshes["Cube"])
            obj.location.x = x
            collection.objects.link(obj)
        second = scene.view_layers.new("Second")
        second.layer_collection.children["H"].holdout = True
        second.layer_collection.children["I"].indirect_only = True
        second.material_override = bpy.data.materials.new("Override")
        second.samples = 7
        bpy.ops.render.render()
        def instances(session):
            return {i["name"]: [i["flags"], i["visibility"], i["materials"]] for i in session.scene.instances.values()}
        a, b = core.sessions
        show(a=instances(a), b=instances(b), samples=[s.settings[-1]["samples"] for s in (a, b)],
             override=list(b.scene.materials), names=[m["name"] for m in b.scene.materials.values()])
        """,
        tmp_path,
    )
    assert facts["a"]["H"][0] == 0 and facts["b"]["H"][0] == 2
    assert facts["a"]["I"][1] & 1 and not facts["b"]["I"][1] & 1
    assert facts["a"]["Cube"][2] != [0]
    assert "Override" in facts["names"]
    assert facts["b"]["Cube"][2] == [facts["override"][facts["names"].index("Override")]]
    assert facts["samples"] == [4, 7]


@pytest.mark.parametrize(
    "break_it, words",
    [
        ("scene.headwater.device = 'Nowhere'", ["Nowhere"]),
        ("core.fail_with = RuntimeError('device lost')", ["device lost"]),
        ("bpy.data.objects['Camera'].scale = (0, 0, 0)", ["Camera"]),
        ("scene.camera = bpy.data.objects['Cube']", ["Cube", "camera"]),
        ("core.Scene.upsert_mesh = lambda *a, **k: 1 / 0", ["Cube", "division"]),
    ],
)
def test_errors_name_what_is_wrong_and_leave_blender_usable(tmp_path, break_it, words):
    facts = run(
        f"""
        import sys
        broken = sys.modules["headwater._core"]
        core = broken
        {break_it}
        message = ""
        try:
            bpy.ops.render.render(write_still=True)
        except RuntimeError as error:
            message = str(error)
        show(message=message, last=hb.last_error())
        """,
        tmp_path,
    )
    assert facts["last"], "no error was remembered"
    for word in words:
        assert word.lower() in facts["last"].lower()
        assert word.lower() in facts["message"].lower()


def test_what_blender_itself_refuses_is_an_error_too(tmp_path):
    facts = run(
        """
        def message():
            try:
                bpy.ops.render.render()
            except RuntimeError as error:
                return str(error)
        camera, scene.camera = scene.camera, None
        no_camera = message()
        scene.camera = camera
        scene.render.use_border = True
        scene.render.border_min_x = scene.render.border_max_x = 0.5
        show(no_camera=no_camera, empty_border=message())
        """,
        tmp_path,
    )
    assert "no camera" in facts["no_camera"] and "too small" in facts["empty_border"]


def test_a_core_that_does_not_load_says_why(tmp_path):
    facts = run(
        """
        import sys, headwater
        sys.modules["headwater._core"] = None
        if hasattr(headwater, "_core"): del headwater._core
        import headwater_addon.native as native
        native._core = None
        message = ""
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            message = str(error)
        show(message=message, failure=native.failure(), last=hb.last_error(),
             device=bpy.context.preferences.addons["headwater_addon"].preferences.device)
        """,
        tmp_path,
    )
    assert "did not load" in facts["message"] and "did not load" in facts["failure"]
    assert facts["device"] == "AUTO"


def test_cancel_ends_quickly_and_keeps_the_picture(tmp_path):
    facts = run(
        """
        import time
        core.render_seconds = 30.0
        import headwater_addon.final as final
        final.observers.append(lambda event, facts: event == "progress" and facts["seconds"] >= 0)
        start = time.time()
        bpy.ops.render.render(write_still=True)
        show(seconds=time.time() - start, cancelled=core.sessions[-1].cancelled.is_set(), error=hb.last_error())
        """,
        tmp_path,
    )
    assert facts["cancelled"] and facts["seconds"] < 10 and facts["error"] == ""
    assert list(tmp_path.glob("frame_*.png"))


def test_command_line_options(tmp_path):
    stats = tmp_path / "stats.json"
    facts = run(
        "bpy.ops.render.render(); s = core.sessions[-1]; show(settings=s.settings[-1], tracer=s.context.tracer)",
        tmp_path,
        arguments=[
            "--",
            "--headwater-samples",
            "9",
            "--headwater-stats",
            str(stats),
            "--headwater-tracer",
            "embree",
            "--other",
            "1",
        ],  # fmt: skip
    )
    assert facts["settings"]["samples"] == 9 and facts["tracer"] == "embree"
    line = json.loads(stats.read_text().splitlines()[-1])
    assert line["samples"] == 9 and line["frame"] == 1 and line["export"]["instances"] == 1

    bad = run(
        "try:\n    bpy.ops.render.render()\nexcept RuntimeError as error:\n    show(message=str(error))",
        tmp_path,
        arguments=["--", "--headwater-samples", "none"],
    )
    assert "--headwater-samples" in bad["message"]


def test_strict_makes_a_failed_render_fail_the_process(tmp_path):
    failing = (
        "scene.camera = bpy.data.objects['Cube']\ntry:\n    bpy.ops.render.render()\nexcept RuntimeError:\n    pass\n"
    )
    code = failing + "# normal exit\n"
    assert run(code, tmp_path, arguments=["--", "--headwater-strict"], check=False)["status"] == 1
    assert run("bpy.ops.render.render()\n", tmp_path, arguments=["--", "--headwater-strict"])["status"] == 0


def test_without_the_cycles_addon(tmp_path):
    facts = run(
        """
        import addon_utils
        addon_utils.disable("cycles")
        scene.headwater.use_cycles_settings = True
        scene.view_layers[0].headwater.use_pass_denoising = True
        scene.headwater.max_bounces = 3
        light = bpy.data.lights[0]
        light.headwater.use_mis = False
        bpy.data.worlds[0].headwater.diffuse = False
        bpy.data.objects["Cube"].active_material.headwater.emission_sampling = "NONE"
        bpy.ops.render.render()
        session = core.sessions[-1]
        show(cycles=hasattr(scene, "cycles"), settings=session.settings[-1], flags=core.flags,
             light=list(session.scene.lights.values())[0]["flags"], world=session.scene.world["flags"],
             material=session.scene.named("materials", "Material")[0]["flags"])
        """,
        tmp_path,
    )
    assert not facts["cycles"]
    assert facts["material"] & facts["flags"]["HW_MATERIAL_NO_MIS"]
    assert facts["settings"]["max_bounces"] == 3 and facts["settings"]["samples"] == 4
    assert "Denoising Albedo" in facts["settings"]["passes"]
    assert not facts["light"] & facts["flags"]["HW_LIGHT_USE_MIS"]
    assert (
        not facts["world"] & facts["flags"]["HW_LIGHT_DIFFUSE"] and facts["world"] & facts["flags"]["HW_LIGHT_GLOSSY"]
    )


def test_settings_come_from_cycles_when_wanted(tmp_path):
    facts = run(
        """
        from headwater_addon import options, render_settings
        cycles, own = scene.cycles, scene.headwater
        cycles.samples, cycles.max_bounces, cycles.transparent_max_bounces, cycles.blur_glossy = 33, 5, 6, 0.25
        cycles.sample_clamp_indirect, cycles.film_exposure, cycles.pixel_filter_type = 2.5, 1.5, "BOX"
        cycles.filter_width = 3.0
        layer = scene.view_layers[0]
        def build():
            frame = render_settings.frame_of(scene.render)
            return render_settings.build(scene, layer, frame, ["Combined"], options.Options())
        own.use_cycles_settings = False
        mine = build()
        own.use_cycles_settings = True
        theirs = build()
        layer.samples = 100
        use = build()["samples"]
        cycles.use_layer_samples = "BOUNDED"
        bounded = build()["samples"]
        cycles.use_layer_samples = "IGNORE"
        ignored = build()["samples"]
        cycles.use_sample_subset, cycles.sample_offset, cycles.sample_subset_length = True, 10, 8
        subset = build()
        cycles.seed, cycles.use_animated_seed = 3, True
        seeds = []
        for frame in (1, 2):
            scene.frame_set(frame)
            seeds.append(build()["seed"])
        show(mine=mine, theirs=theirs, layers=[use, bounded, ignored], subset=subset, seeds=seeds)
        """,
        tmp_path,
    )
    mine, theirs = facts["mine"], facts["theirs"]
    assert mine["samples"] == 4 and mine["max_bounces"] == 12 and mine["filter"] == "BLACKMAN_HARRIS"
    assert (theirs["samples"], theirs["max_bounces"], theirs["transparent_bounces"]) == (33, 5, 6)
    assert (theirs["filter_glossy"], theirs["clamp_indirect"], theirs["exposure"]) == (0.25, 2.5, 1.5)
    assert theirs["filter"] == "BOX" and theirs["filter_width"] == 1.0  # Cycles' box has no width
    assert facts["layers"] == [100, 33, 33]
    assert facts["subset"]["first_sample"] == 10 and facts["subset"]["samples"] == 8
    assert facts["seeds"][0] != facts["seeds"][1]

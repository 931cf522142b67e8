# SPDX-License-Identifier: Apache-2.0
"""Parameters of reservoir integrators in Blender, with the core replaced by a fake: properties to settings, the panel,
texts, saved files, and the command's options over a file's."""

import numpy as np
import pytest
from bpy_process import run

from headwater.integrators import INTEGRATORS, PARAMETERS, Switch

pytest.importorskip("bpy")


def float32(value):
    return value if isinstance(value, (str, bool)) else np.float32(value)


BUILD = """
from headwater_addon import options, render_settings
from headwater.integrators import INTEGRATORS, PARAMETERS
own = scene.headwater
def build():
    frame = render_settings.frame_of(bpy.context.scene.render)
    settings = render_settings.build(
        bpy.context.scene, bpy.context.scene.view_layers[0], frame, ["Combined"], options.Options())
    wanted = {"integrator", "estimator", *PARAMETERS}
    return {name: value for name, value in settings.items() if name in wanted}
"""


def expected(integrator, **changed):
    """What Blender sends for an integrator whose properties were left as they are, but for `changed`."""
    estimator = changed.get("estimator", "paper")
    values = {
        name: None if isinstance(PARAMETERS[name], Switch) and PARAMETERS[name].automatic else value
        for name, value in INTEGRATORS[integrator].parameters(estimator).items()
        if not PARAMETERS[name].by_scene
    }
    return {"integrator": integrator, "estimator": estimator} | values | changed


def sent(facts, *integrators):
    """Asserts the settings shown under each integrator's name, to float precision."""
    for name, wanted in integrators:
        assert {k: v if v is None else float32(v) for k, v in facts[name].items()} == {
            k: v if v is None else float32(v) for k, v in wanted.items()
        }


def test_properties_become_settings(tmp_path):
    facts = run(
        BUILD
        + """
shown = {}
for name in INTEGRATORS:
    own.integrator, own.estimator = name, "unbiased"
    shown[name + " unbiased"] = build()
    own.estimator = "paper"
    shown[name] = build()
own.integrator = "restir"
own.restir.candidates, own.restir.reuse_radius, own.restir.temporal_reuse = 7, 0.25, False
own.restir.reuse_weights, own.restir.visibility_reuse = "mis", "ON"
shown["changed"] = build()
own.restir.visibility_reuse = "OFF"
shown["off"] = build()["visibility_reuse"]
own.restir.candidates = 0  # Blender keeps it in the range
shown["clipped"] = build()["candidates"]
own.integrator = "restir-reproject"
shown["other"] = build()
show(**shown)
""",
        tmp_path,
    )
    sent(facts, *((name, expected(name)) for name in INTEGRATORS))
    sent(facts, *((f"{name} unbiased", expected(name, estimator="unbiased")) for name in INTEGRATORS))
    changes = {"candidates": 7, "reuse_radius": 0.25, "temporal_reuse": False, "reuse_weights": "mis"}
    sent(facts, ("changed", expected("restir", visibility_reuse=True, **changes)))
    sent(facts, ("other", expected("restir-reproject")))
    assert facts["off"] is False and facts["clipped"] == 1


def test_a_file_keeps_what_was_set_and_no_more(tmp_path):
    """What an artist left alone follows the integrator's default, also in a file that was saved."""
    facts = run(
        BUILD
        + """
own.integrator = "wssr-grid"
own.wssr_grid.grid_extent = 8
bpy.ops.wm.save_as_mainfile(filepath=tmp + "/saved.blend")
bpy.ops.wm.read_homefile(use_factory_startup=True)
bpy.ops.wm.open_mainfile(filepath=tmp + "/saved.blend")
group = bpy.context.scene.headwater.wssr_grid
show(saved=build(), set=[name for name in INTEGRATORS["wssr-grid"].defaults if group.is_property_set(name)])
""",
        tmp_path,
    )
    sent(facts, ("saved", expected("wssr-grid", grid_extent=8)))
    assert facts["set"] == ["grid_extent"]


PANEL = """
import headwater_addon.ui.render as ui
class Row:
    '''A layout that notes what it is asked to show: (group, property, active).'''
    def __init__(self, log): self.__dict__["log"] = log; self.__dict__["active"] = True
    def __getattr__(self, name): return lambda *a, **k: Row(self.log)
    def prop(self, data, name, **k):
        assert name in data.bl_rna.properties
        self.log.append((type(data).__name__, name, bool(self.active)))
    def label(self, text): self.log.append(text)
    use_property_split = use_property_decorate = False
class Context:
    engine = "HEADWATER"
    scene = bpy.context.scene
panel = ui.HEADWATER_RENDER_PT_reservoirs
def draw():
    log = []
    panel.draw(type("P", (), {"layout": Row(log)})(), Context)
    return log
"""


def test_panel_shows_what_the_integrator_reads_and_its_memory(tmp_path):
    facts = run(
        PANEL
        + """
from headwater.integrators import INTEGRATORS
own = scene.headwater
polls, drawn = {}, {}
for name in INTEGRATORS:
    own.integrator = name
    polls[name] = panel.poll(Context)
    for own.estimator in ("unbiased", "paper"):
        if polls[name]: drawn[name + " " + own.estimator] = draw()
own.integrator, own.restir.spatial_reuse = "restir", False
off = draw()
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 4096, 2048, 50
large = draw()[-1]
own.estimator = "paper"
refuse = core.reservoir_bytes
core.reservoir_bytes = lambda settings: refuse(settings | {"neighbours": 99})
refused = draw()[-1]
# No core: neither number nor error.
import sys, headwater
sys.modules["headwater._core"] = None
del headwater._core
import headwater_addon.native as native
native._core = None
show(polls=polls, drawn=drawn, off=off, large=large, refused=refused, without=draw(), active=draw())
""",
        tmp_path,
    )
    assert facts["polls"] == dict.fromkeys(INTEGRATORS, True)
    for name, drawn in facts["drawn"].items():
        integrator, estimator = name.split()
        *properties, memory = drawn if integrator != "path" else [*drawn, "Memory: 0.0 MiB at 32 × 24"]
        read = INTEGRATORS[integrator].parameters(estimator)
        needs = {p: PARAMETERS[p].needs for p in read}
        assert [(prop, on) for _, prop, on in properties] == [(p, not needs[p] or read[needs[p]]) for p in read]
        assert memory == "Memory: 0.0 MiB at 32 × 24"
    inactive = {prop for _, prop, active in facts["off"][:-1] if not active}
    assert inactive == {"neighbours", "reuse_radius"}
    assert facts["large"] == "Memory: 128.0 MiB at 2048 × 1024"  # 64 bytes a pixel: the double's
    assert facts["refused"].startswith("neighbours must be")
    assert facts["without"] == facts["off"][:-1], "all properties, no text"


def test_render_status_and_statistics_name_the_reservoirs(tmp_path):
    facts = run(
        """
        import headwater_addon.final as final
        core.render_seconds = 0.2
        texts, frames, status_text = [], [], final.status_text
        final.status_text = lambda *arguments: texts.append(status_text(*arguments)) or texts[-1]
        final.observers.append(lambda event, facts: event == "frame" and frames.append(facts))
        scene.render.resolution_x, scene.render.resolution_y = 512, 256
        stats = core.Session.stats
        core.Session.stats = lambda self: stats(self) | {"reservoir_bytes": 4711}
        scene.headwater.integrator = "path"
        bpy.ops.render.render()
        path = texts.pop()
        scene.headwater.integrator = "wssr-grid"
        bpy.ops.render.render()
        show(path=path, grid=texts[-1], facts=frames[-1], error=hb.last_error(),
             sent=core.sessions[-1].settings[-1]["grid_resolution"])
        """,
        tmp_path,
    )
    assert facts["error"] == "" and facts["sent"] == 100
    assert "Reservoirs" not in facts["path"] and "Reservoirs 8.0 MiB" in facts["grid"]
    assert facts["facts"]["integrator"] == "wssr-grid" and facts["facts"]["core"]["reservoir_bytes"] == 4711


def test_every_property_says_its_effect(tmp_path):
    """Tooltips: a sentence that starts with a capital and ends without a full stop, which Blender adds."""
    facts = run(
        """
        from headwater.integrators import INTEGRATORS
        found = {}
        for each in INTEGRATORS.values():
            for estimator in ("paper", "unbiased"):
                group = each.group(estimator)
                for name in each.parameters(estimator):
                    prop = getattr(scene.headwater, group).bl_rna.properties[name]
                    items = [(i.name, i.description) for i in prop.enum_items] if prop.type == "ENUM" else []
                    found[f"{group}.{name}"] = [prop.name, prop.description, items]
        chooser = scene.headwater.bl_rna.properties["integrator"].enum_items
        show(found=found, integrators=[[i.identifier, i.name, i.description] for i in chooser],
             unit=scene.headwater.wssr_grid.bl_rna.properties["grid_extent"].unit)
        """,
        tmp_path,
    )
    for name, (label, description, items) in facts["found"].items():
        for text in (description, *(item[1] for item in items)):
            assert text and text[0].isupper() and not text.endswith("."), name
        assert label == label.strip() and label[0].isupper()
        assert ". " in description, f"{name}: what it is, and then its effect"
    assert facts["integrators"] == [[e.name, e.label, e.description.rstrip(".")] for e in INTEGRATORS.values()]
    assert facts["unit"] == "LENGTH"


def test_the_commands_options_win_over_the_files(tmp_path):
    facts = run(
        BUILD
        + """
from headwater.blend_overrides import apply
from headwater.errors import UserError
from headwater.render_request import Request
def answer(**wishes):
    try:
        apply(scene, Request.blank("x.blend", output="x.exr", **wishes))
    except UserError as error:
        return [error.status, str(error)]
    return build()
own.integrator = "wssr-kd"
own.wssr_kd.ascension, own.wssr_kd.neighbours = 4, 2
show(
    own=answer(reuse={"neighbours": 6, "temporal_reuse": False}),
    other=answer(integrator="restir", estimator="paper", reuse={"visibility_reuse": False, "reuse_weights": "1/Z"}),
    range=answer(reuse={"candidates": 0}),
    unread=answer(integrator="path", reuse={"candidates": 2}),
    estimator=answer(integrator="restir", estimator="magic"),
    unbiased=answer(integrator="wssr-kd", estimator="unbiased", reuse={"ascension": 3, "mis_weights": "balance"}),
    stays=answer(reuse={"history": 9}),  # the file's estimator is unbiased now, and decides who reads what
    paper=answer(reuse={"empty_cells": "black"}),
)
""",
        tmp_path,
    )
    sent(facts, ("own", expected("wssr-kd", ascension=4, neighbours=6, temporal_reuse=False)))
    sent(facts, ("other", expected("restir", visibility_reuse=False, reuse_weights="1/Z")))
    unbiased = {"estimator": "unbiased", "ascension": 3, "mis_weights": "balance"}
    sent(facts, ("unbiased", expected("wssr-kd", **unbiased)))
    sent(facts, ("stays", expected("wssr-kd", history=9, **unbiased)))
    refused = (("range", "candidates"), ("unread", "candidates"), ("estimator", "magic"), ("paper", "empty_cells"))
    for name, word in refused:
        status, text = facts[name]
        assert status == 2 and word in text

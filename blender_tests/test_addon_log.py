# SPDX-License-Identifier: Apache-2.0
"""The add-on's log and statistics: what is kept, that a click finds what it is about, what a picture cost; presets."""

import pytest
from bpy_process import run

pytest.importorskip("bpy")


def test_log_keeps_each_text_once_and_a_bounded_number(tmp_path):
    facts = run(
        """
        from headwater_addon.log import CAPACITY, Log
        log = Log()
        for number in range(CAPACITY + 50):
            log.add("WARNING", f"text {number}", "Object", f"Object {number}")
        first = log.entries()
        log.add("WARNING", "text 100")
        log.add("ERROR", "text 100")
        last = log.entries()
        numbers = {entry.number for entry in first}
        text = log.as_text()
        log.clear()
        show(capacity=CAPACITY, count=len(first), newest=first[0].text, oldest=first[-1].text, numbers=len(numbers),
             again=[(e.severity, e.text, e.times, e.name) for e in last[:2]], still=len(last), empty=len(log.entries()),
             lines=text.count("\\n"), twice="text 100 (2 times)" in text)
        """,
        tmp_path,
    )
    assert facts["count"] == facts["still"] == facts["numbers"] == facts["lines"] == facts["capacity"]
    assert facts["newest"] == f"text {facts['capacity'] + 49}" and facts["oldest"] == "text 50"
    assert facts["again"] == [["ERROR", "text 100", 1, ""], ["WARNING", "text 100", 2, "Object 100"]]
    assert facts["empty"] == 0 and facts["twice"]


def test_log_takes_entries_from_many_threads_while_it_is_read(tmp_path):
    facts = run(
        """
        import sys, threading
        from headwater_addon.log import Log
        sys.setswitchinterval(1e-6)
        log, errors = Log(50), []
        def work():
            try:
                for number in range(2000):
                    log.add("ERROR", f"{number % 20}")
                    if number % 100 == 0:
                        log.entries(), log.as_text()
            except Exception as error:
                errors.append(repr(error))
        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
        entries = log.entries()
        show(errors=errors, times=[e.times for e in entries], numbers=len({e.number for e in entries}))
        """,
        tmp_path,
    )
    assert facts["errors"] == []
    assert facts["times"] == [300] * 20, "no word is lost"
    assert facts["numbers"] == 20


SCENE = """
import headwater_addon.log as module
log = module.log
def click(name):
    entry = next(e for e in log.entries() if e.name == name)
    try:
        status = bpy.ops.headwater.show_log_item(number=entry.number).pop()
    except RuntimeError as error:
        status = str(error)
    active = bpy.context.view_layer.objects.active
    return [status, active.name if active else "", sorted(o.name for o in bpy.context.selected_objects)]
def add(name, data):
    obj = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    return obj
cube = bpy.data.objects["Cube"]
"""


def test_notes_of_a_render_are_in_the_log_and_a_click_finds_their_objects(tmp_path):
    facts = run(
        SCENE
        + """
plain, volume = bpy.data.materials.new("Plain"), bpy.data.materials.new("Fog")
volume.use_nodes = True
tree = volume.node_tree
output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
mesh = cube.data.copy()
mesh.materials.clear()
mesh.materials.append(plain)
mesh.materials.append(volume)
box = add("Box", mesh)
inside = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
texture = inside.nodes.new("ShaderNodeTexImage")
texture.image = bpy.data.images.new("Brick", 4, 4)
inner = inside.nodes.new("NodeGroupOutput")
inside.interface.new_socket(name="Color", in_out="OUTPUT", socket_type="NodeSocketColor")
inside.links.new(texture.outputs["Color"], inner.inputs[0])
texture.image.source, texture.image.filepath = "FILE", tmp + "/nowhere.png"
material = cube.material_slots[0].material
group = material.node_tree.nodes.new("ShaderNodeGroup")
group.node_tree = inside
shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
material.node_tree.links.new(group.outputs[0], shader.inputs["Base Color"])
add("Fur", bpy.data.hair_curves.new("Hair"))
world = scene.world
world.use_nodes = True
end = next(n for n in world.node_tree.nodes if n.type == "OUTPUT_WORLD")
world.node_tree.links.new(world.node_tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], end.inputs["Volume"])
bpy.ops.render.render()
kinds = sorted((e.severity, e.kind, e.name) for e in log.entries())
texts = [e.text for e in log.entries() if e.kind == "World"]
clicks = {name: click(name) for name in ("Fur", "Fog", "Brick", world.name)}
slot, node = box.active_material_index, tree.nodes.active.name
bpy.ops.wm.read_homefile(use_factory_startup=True)
show(kinds=kinds, clicks=clicks, slot=slot, node=node, loaded=len(log.entries()),
     world=texts)
""",
        tmp_path,
    )
    assert facts["kinds"] == [
        ["WARNING", "Image", "Brick"],
        ["WARNING", "Material", "Fog"],
        ["WARNING", "Object", "Fur"],
        ["WARNING", "World", "World"],
    ]
    assert facts["world"][0].startswith("World 'World': ")
    assert facts["clicks"] == {
        "Fur": ["FINISHED", "Fur", ["Fur"]],
        "Fog": ["FINISHED", "Box", ["Box"]],
        "Brick": ["FINISHED", "Cube", ["Cube"]],
        "World": ["FINISHED", "Cube", ["Cube"]],
    }
    assert facts["slot"] == 1 and facts["node"] == "Material Output"
    assert facts["loaded"] == 0, "another file's problems are not this one's"


def test_click_says_what_is_gone_or_out_of_reach(tmp_path):
    facts = run(
        SCENE
        + """
for kind, name in (("Object", "Gone"), ("Material", "Unknown"), ("Material", "Unused"), ("Object", "Elsewhere"),
                   ("Mesh", "Shape"), ("Object", "Hidden"), ("World", "No World"), ("Light", "Bulb"), ("", "Cube")):
    log.add("WARNING", f"about {kind} {name}", kind, name)
bpy.data.materials.new("Unused")
bpy.data.objects.new("Elsewhere", cube.data)
shape = add("Shaped", bpy.data.meshes.new("Shape"))
hidden = add("Hidden", cube.data)
hidden.hide_set(True)
add("Lamp of a Bulb", bpy.data.lights.new("Bulb", "POINT"))
clicks = {e.name: click(e.name) for e in log.entries()}
number = log.entries()[0].number
bpy.context.view_layer.objects.active = cube
bpy.ops.object.mode_set(mode="EDIT")
edit = click("Shape"), cube.mode
bpy.ops.headwater.clear_log()
status = list(bpy.ops.headwater.show_log_item(number=number))
show(clicks=clicks, cleared=len(log.entries()), status=status, edit=edit)
""",
        tmp_path,
    )
    clicks = {name: click[:2] for name, click in facts["clicks"].items()}
    assert clicks["Shape"] == ["FINISHED", "Shaped"] and clicks["Hidden"] == ["FINISHED", "Hidden"]
    assert clicks["Bulb"] == ["FINISHED", "Lamp of a Bulb"]
    assert {name for name, (status, _) in clicks.items() if status == "CANCELLED"} == {
        "Gone", "Unknown", "Unused", "Elsewhere", "No World",
    }  # fmt: skip
    for text in (
        "Object 'Gone' is gone",
        "Material 'Unknown' is gone",
        "No object uses Material 'Unused'",
        "Object 'Elsewhere' is not in view layer",
        "World 'No World' is gone",
        "no longer in the log",
        "Selected 'Hidden', which is hidden",
    ):
        assert text in facts["stdout"], text
    assert facts["edit"] == [["FINISHED", "Shaped", ["Shaped"]], "OBJECT"]
    assert facts["cleared"] == 0 and facts["status"] == ["CANCELLED"]


def test_errors_name_what_they_are_about(tmp_path):
    facts = run(
        SCENE
        + """
from headwater_addon.sync.problems import SyncError
core.fail_with = ValueError("samples must be at least 1")
try: bpy.ops.render.render()
except RuntimeError: pass
bpy.data.objects["Camera"].scale = (0, 0, 0)
try: bpy.ops.render.render()
except RuntimeError: pass
module.error("it is broken", SyncError("it is broken", "Light", "Lamp"))
module.error('instance "Tree": no mesh has id 3')
module.error("The device is lost")
show(entries=[(e.severity, e.kind, e.name, e.text) for e in reversed(log.entries())])
""",
        tmp_path,
    )
    entries = [tuple(entry) for entry in facts["entries"]]
    assert [entry[:3] for entry in entries] == [
        ("ERROR", "", ""),
        ("ERROR", "Camera", "Camera"),
        ("ERROR", "Light", "Lamp"),
        ("ERROR", "Object", "Tree"),
        ("ERROR", "", ""),
    ]
    assert entries[0][3] == "samples must be at least 1", "without the engine's name: the panel has it"


def test_statistics_have_the_last_picture_and_its_stages(tmp_path):
    facts = run(
        """
        import headwater_addon.final as final
        import headwater_addon.ui.statistics as ui
        first = ui.HEADWATER_RENDER_PT_statistics_render.applies(None)
        core.Session.stats = lambda self: {
            "samples": 4, "rays": 12345678, "seconds": 2.0, "mrays_per_second": 6.172839, "reservoir_bytes": 3 << 20,
            "device": "GPU", "tracer": "ray_query",
            "stages": {f"s{i:02}": 0.1 * (i + 1) for i in range(15)}, "memory": {"device_bytes": 12 << 20},
        }
        scene.headwater.integrator = "restir"
        bpy.ops.render.render()
        rows = ui.render_rows(final.last_facts)
        core.Session.stats = lambda self: {"reservoir_bytes": 0, "rays": 1, "memory": {}}
        bpy.ops.render.render()
        few = dict(ui.render_rows(final.last_facts))["Reservoirs"]
        after = ui.HEADWATER_RENDER_PT_statistics_render.applies(None)
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        show(rows=rows, first=first, after=after, loaded=final.last_facts, few=few,
             view=ui.HEADWATER_RENDER_PT_statistics_viewport.applies(None))
        """,
        tmp_path,
    )
    rows = [tuple(row) for row in facts["rows"]]
    table = dict(rows)
    assert not facts["first"] and facts["after"] and facts["loaded"] is None and not facts["view"]
    assert table["Integrator"] == "ReSTIR" and table["Size"] == "32 × 24" and table["Samples"] == "4"
    assert table["Speed"] == "6.17 Mrays/s" and table["Rays"] == "12,345,678"
    assert table["Reservoirs"] == "3.0 MiB, 25% of device memory"
    stages = rows[rows.index(("Stages", "")) + 1 :]
    assert [name for name, _ in stages] == [f"s{i:02}" for i in range(14, 2, -1)] + ["others"]
    assert stages[0][1] == "1.50 s, 12%" and stages[-1][1] == "600.0 ms, 5%"
    assert table["Device"] == "GPU" and table["Ray Tracing"] == "Vulkan Ray Query"
    assert facts["few"].startswith("none")


def test_presets_keep_the_integrator_and_what_it_reads(tmp_path):
    facts = run(
        """
        import os
        bpy.utils.user_resource = lambda kind, path="", create=False: (os.makedirs(f"{tmp}/{path}", exist_ok=True)
                                                                       or f"{tmp}/{path}")
        own = scene.headwater
        def store(name):
            assert bpy.ops.headwater.sampling_preset_add(name=name) == {"FINISHED"}
            return open(f"{tmp}/presets/headwater/sampling/{name}.py").read()
        own.integrator, own.restir.candidates, own.restir.temporal_reuse = "restir", 7, False
        own.samples, own.preview_samples, own.clamp_indirect = 33, 44, 3.5
        ours = store("ours")
        own.use_cycles_settings, scene.cycles.samples, scene.cycles.preview_samples = True, 55, 66
        own.integrator = "path"
        theirs = store("theirs")
        own.restir.candidates, own.restir.temporal_reuse = 1, True
        own.samples = own.preview_samples = scene.cycles.samples = scene.cycles.preview_samples = 1
        own.clamp_indirect = 0
        def load(name):
            bpy.utils.execfile(f"{tmp}/presets/headwater/sampling/{name}.py")
            return [own.integrator, own.restir.candidates, own.restir.temporal_reuse, own.use_cycles_settings,
                    own.samples, own.preview_samples, own.clamp_indirect, scene.cycles.samples,
                    scene.cycles.preview_samples]
        show(ours=load("ours"), theirs=load("theirs"), grid="wssr" in ours + theirs)
        """,
        tmp_path,
    )
    assert facts["ours"] == ["restir", 7, False, False, 33, 44, 3.5, 1, 1]
    assert facts["theirs"] == ["path", 7, False, True, 33, 44, 3.5, 55, 66]
    assert not facts["grid"], "parameters of other integrators are left alone"

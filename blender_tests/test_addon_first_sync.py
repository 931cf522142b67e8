# SPDX-License-Identifier: GPL-3.0-or-later
"""The first sync, where the core builds beside the reading of Blender's data, and frames after it in an animation."""

import pytest
from bpy_process import run


def test_edits_wait_while_a_build_runs(tmp_path):
    facts = run(
        """
        import threading, time
        from headwater_addon_name.sync import build
        build.FIRST_BATCH = build.LAST_BATCH = 10
        class Scene:
            def __init__(self): self.log, self.building = [], False
            def upsert_mesh(self, number, name, *rest):
                assert not self.building
                if name == "bad": raise ValueError("bad mesh")
                self.log.append(number)
            def upsert_instance(self, number, *rest):
                assert not self.building
                self.log.append(-number)
        def queued(scene, work=None):
            queue = build.Edits(scene)
            queue.begin(work)
            return queue
        def edits(go):
            scene = Scene()
            def work():
                scene.building = True
                go.wait(20)
                scene.building = False
                return {"meshes": len(scene.log)}
            return scene, queued(scene, work)
        triangles = np.zeros((12, 3))
        go = threading.Event()
        scene, queue = edits(go)
        queue.upsert_mesh(1, "a", None, triangles)
        queue.upsert_instance(1, 1)
        queue.upsert_mesh(2, "b", None, triangles)
        during = list(scene.log)
        go.set()
        queue.finish()
        after, built = list(scene.log), list(queue.built)
        scene, queue = edits(go)
        queue.upsert_mesh(3, "a", None, triangles[:3])
        queue.start_last()
        small = len(queue.built)
        errors = []
        go.clear()
        queue.upsert_mesh(4, "a", None, triangles)
        queue.upsert_mesh(5, "bad", None, triangles)
        go.set()
        try: queue.finish()
        except ValueError as error: errors.append(str(error))
        queue.abandon()
        def fail(): raise MemoryError("no room")
        queue = queued(Scene(), fail)
        queue.upsert_mesh(6, "a", None, triangles)
        try: queue.finish()
        except MemoryError as error: errors.append(str(error))
        go.clear()
        scene, queue = edits(go)
        queue.upsert_mesh(8, "a", None, triangles)
        queue.upsert_mesh(9, "b", None, triangles)
        queue.start_last()
        waited = list(scene.log)
        queue.upsert_instance(9, 9)
        go.set()
        queue.finish()
        last = [list(scene.log), list(queue.built)]
        straight = queued(scene)
        straight.upsert_mesh(7, "a", None, triangles)
        straight.start_last(); straight.finish()
        show(waited=waited, last=last, during=during, after=after, built=built, small=small, errors=errors,
             straight=scene.log[-1], threads=threading.active_count())
        """.replace("headwater_addon_name", _module()),
        tmp_path,
    )
    assert facts["during"] == [1] and facts["after"] == [1, -1, 2]
    assert facts["built"] == [{"meshes": 1}], "one build, of what was there when it began"
    assert facts["waited"] == [8], "the last build is asked for, not waited for"
    assert facts["last"] == [[8, 9, -9], [{"meshes": 1}, {"meshes": 2}]]
    assert facts["small"] == 0, "not worth a build of its own"
    assert facts["errors"] == ["bad mesh", "no room"]
    assert facts["straight"] == 7 and facts["threads"] == 1


def _module() -> str:
    import headwater.blender

    return headwater.blender.MODULE


# A scene of seven small objects whose first build goes on until the last of them has been read.
_LONG_BUILD = """
import importlib, threading, time
module = lambda name: importlib.import_module(hb.MODULE + name)
build, state, problems = module(".sync.build"), module(".sync.state"), module(".sync.problems")
build.FIRST_BATCH, build.LAST_BATCH = 10, 10**9
for i in range(6):
    bpy.ops.mesh.primitive_cube_add(location=(i - 2, -2, 0), size=0.4)
    bpy.context.object.name, bpy.context.object.data.name = f"Object {i}", f"Data {i}"
building, read = threading.Event(), threading.Event()
class Scene(core.Scene):
    "One that is edited and committed by one thread at a time, and refuses a mesh."
    refused, clashes, user = "", [], None
    def __getattribute__(self, name):
        found = super().__getattribute__(name)
        return guarded(name, found) if name.startswith(("upsert", "remove", "set_")) else found
def guarded(name, call):
    def edit(*arguments, **settings):
        me = threading.get_ident()
        if Scene.user not in (None, me): Scene.clashes.append((name, str(arguments[1])))
        before, Scene.user = Scene.user, me
        try:
            if name == "upsert_mesh" and arguments[1] == Scene.refused: raise core.SceneError("a mesh too many")
            return call(*arguments, **settings)
        finally: Scene.user = before
    return edit
core.Scene = Scene
builds = []
class Session(core.Session):
    def sync(self):
        if not self.edits: guarded("sync", lambda *_: building.set() or read.wait(20))("build", "build")
        return super().sync()
core.Session = Session
give = build._Builder.give
build._Builder.give = lambda *arguments: give(*arguments) or building.wait(20)
collect = state.instances.collect
def collected(*arguments):
    try: return collect(*arguments)
    finally: read.set()
state.instances.collect = collected
"""


def test_nothing_edits_the_scene_while_it_is_built(tmp_path):
    facts = run(
        _LONG_BUILD
        + """
bpy.ops.render.render()
fake = core.sessions[-1].scene
show(clashes=Scene.clashes, materials=[len(fake.named("instances", f"Object {i}")[0]["materials"]) for i in range(6)],
     defaults=len(fake.named("materials", "Default")), builds=len(core.sessions[-1].edits))
""",
        tmp_path,
    )
    assert facts["builds"] == 2, "one beside the reading, one after it"
    assert facts["defaults"] == 1 and facts["materials"] == [1] * 6, "empty slots' material came up during the build"
    assert facts["clashes"] == []


def test_an_edit_refused_while_it_waited_names_its_object_and_is_made_again(tmp_path):
    facts = run(
        _LONG_BUILD
        + """
final = module(".final")
scene.render.use_persistent_data = True
Scene.refused = "Data 3"
try: bpy.ops.render.render()
except RuntimeError: pass
error = final.last_error
Scene.refused = ""
bpy.ops.render.render()
fake = core.sessions[-1].scene
show(error=error, then=final.last_error, meshes=sorted(mesh["name"] for mesh in fake.meshes.values()),
     instances=len(fake.instances), sessions=len(core.sessions), clashes=Scene.clashes)
""",
        tmp_path,
    )
    assert facts["error"].endswith("Object 'Object 3': a mesh too many")
    assert facts["then"] == "" and facts["instances"] == 7
    assert facts["meshes"] == ["Cube", *(f"Data {i}" for i in range(6))]
    assert facts["sessions"] == 2, "what came of the refused scene is not used again"
    assert facts["clashes"] == []


def test_a_first_sync_that_was_cancelled_is_not_gone_on_with(tmp_path):
    facts = run(
        _LONG_BUILD
        + """
def breathe():
    if made.meshes.uploaded > 3: raise problems.Cancelled
def cancelled(building):
    global made
    made = state.SceneSync(core)
    read.clear()
    session = core.Session(core.Context(), made.scene)
    try: made.sync(bpy.context.evaluated_depsgraph_get(), False, breathe, build=session.sync if building else None)
    except problems.Cancelled: return made.usable
straight, queued = cancelled(False), cancelled(True)
show(straight=straight, queued=queued, threads=threading.active_count())
""",
        tmp_path,
    )
    assert facts["straight"] is True and facts["queued"] is False and facts["threads"] == 1


_TEXTURED = """
import importlib
build = importlib.import_module(hb.MODULE + ".sync.build")
image = bpy.data.images.new("checks", 8, 8)
image.pixels.foreach_set(np.random.default_rng(1).random(256).astype(np.float32))
image.update(); image.pack()
material = bpy.data.materials.new("m"); material.use_nodes = True
tree = material.node_tree
texture = tree.nodes.new("ShaderNodeTexImage"); texture.image = image
tree.links.new(texture.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
bpy.data.objects["Cube"].data.materials[0] = material
environment = bpy.data.worlds["World"].node_tree
sky = environment.nodes.new("ShaderNodeTexEnvironment"); sky.image = image
environment.links.new(sky.outputs[0], environment.nodes["Background"].inputs[0])
for i in range(5):
    bpy.ops.mesh.primitive_uv_sphere_add(location=(i - 2, -2, 0), radius=0.4)
    bpy.context.object.data.materials.append(material)
twin = bpy.context.object.copy(); twin.location.z = 2; scene.collection.objects.link(twin)
"""


def test_early_builds_change_no_bit_of_the_picture(tmp_path):
    facts = run(
        _TEXTURED
        + """
facts = []
final = importlib.import_module(hb.MODULE + ".final")
final.observers.append(lambda event, what: facts.append(what) if event == "frame" else None)
scene.render.image_settings.file_format = "OPEN_EXR"
scene.frame_start, scene.frame_end = 1, 2
pictures = []
for first in (10**9, 1000):
    build.FIRST_BATCH, build.LAST_BATCH = first, first
    scene.render.filepath = f"{tmp}/p{first}_"
    bpy.ops.render.render(animation=True)
    for frame in (1, 2):
        loaded = bpy.data.images.load(f"{tmp}/p{first}_{frame:04d}.exr")
        pixels = np.empty(len(loaded.pixels), np.float32); loaded.pixels.foreach_get(pixels)
        pictures.append(pixels)
sent = [{k: f["sync"][k] for k in ("meshes_uploaded", "instances_uploaded")} for f in facts]
show(same=[bool(np.array_equal(pictures[i], pictures[i + 2])) for i in (0, 1)], bright=float(pictures[0].mean()),
     sent=sent)
""",
        tmp_path,
        fake=False,
        timeout=300,
    )
    assert facts["same"] == [True, True] and facts["bright"] > 0.05
    late, _, early, second = facts["sent"]
    assert late["meshes_uploaded"] == early["meshes_uploaded"] == 6
    assert early["instances_uploaded"] > late["instances_uploaded"], "the second picture was made with several builds"
    assert second["meshes_uploaded"] == second["instances_uploaded"] == 0


@pytest.mark.parametrize("edit", ["mesh", "material", "world", "group", "none"])
def test_edits_between_frames_are_seen(tmp_path, edit):
    edits = {
        "mesh": "cube.data.vertices[0].co.z += 1; cube.data.update()",
        "material": "material.node_tree.nodes['Principled BSDF'].inputs['Roughness'].default_value = 0.9",
        "world": "bpy.data.worlds['World'].node_tree.nodes['Background'].inputs[1].default_value = 3",
        "group": "group.nodes[0].outputs[0].default_value = 4",
        "none": "pass",
    }
    facts = run(
        _TEXTURED
        + f"""
final = importlib.import_module(hb.MODULE + ".final")
cube = bpy.data.objects["Cube"]
group = bpy.data.node_groups.new("g", "ShaderNodeTree")
group.interface.new_socket("v", in_out="OUTPUT", socket_type="NodeSocketFloat")
value = group.nodes.new("ShaderNodeValue"); out = group.nodes.new("NodeGroupOutput")
group.links.new(value.outputs[0], out.inputs[0])
node = tree.nodes.new("ShaderNodeGroup"); node.node_tree = group
tree.links.new(node.outputs[0], tree.nodes["Principled BSDF"].inputs["IOR"])
def edit(event, facts):
    if event == "frame" and facts["frame"] == 1:
        {edits[edit]}
        bpy.context.view_layer.update()
final.observers.append(edit)
scene.frame_start, scene.frame_end = 1, 3
bpy.ops.render.render(animation=True)
show(kinds=[sorted({{name for name, _ in frame}}) for frame in core.sessions[-1].edits])
""",
        tmp_path,
    )
    expected = {
        "mesh": ["mesh"],
        "material": ["material"],
        "world": ["material", "world"],
        "group": ["material"],
        "none": [],
    }
    assert len(facts["kinds"]) == 3
    assert facts["kinds"][1] == expected[edit] and facts["kinds"][2] == []


def test_meshes_taken_from_where_blender_has_them_give_the_same_picture(tmp_path):
    """Also after Blender wrote other numbers there: what the device did not take was copied when the sync ended."""
    facts = run(
        _TEXTURED
        + """
arrays = importlib.import_module(hb.MODULE + ".sync.arrays")
state = importlib.import_module(hb.MODULE + ".sync.state")
build.FIRST_BATCH, build.LAST_BATCH = 1000, 10**9  # the last meshes are built after the sync
bpy.ops.mesh.primitive_cylinder_add(location=(2, 2, 0), vertices=64)  # faces of many corners
bpy.context.object.data.shade_smooth()
bpy.ops.mesh.primitive_torus_add(location=(-2, 2, 0), major_segments=60, minor_segments=60)
torus = bpy.context.object.data
for layer in list(torus.uv_layers): torus.uv_layers.remove(layer)
torus.shade_smooth()
bumps = tree.nodes.new("ShaderNodeNormalMap")
tree.links.new(texture.outputs[0], bumps.inputs["Color"])
tree.links.new(bumps.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
graph = bpy.context.evaluated_depsgraph_get()
context = core.Context()
meshes = [i.object.data for i in graph.object_instances if i.object.type == "MESH"]
taken = []
in_place = arrays.in_place
def counted(*arguments):
    found = in_place(*arguments)
    taken.append(found is not None)
    return found
def picture(worth, borrow, spoil):
    arrays.WORTH_BORROWING = worth
    made = state.SceneSync(core)
    session = core.Session(context, made.scene)
    taken.clear()
    made.sync(graph, False, once=True, build=session.sync, borrow=borrow)
    count = sum(taken)
    camera = graph.scene.camera.evaluated_get(graph)
    from headwater_addon.render_settings import frame_of
    made.camera.sync(graph, camera, scene.render, frame_of(scene.render))
    if spoil:
        for mesh in meshes:
            mesh.vertices.foreach_set("co", np.full(3 * len(mesh.vertices), 7, np.float32))
            for layer in mesh.uv_layers: layer.uv.foreach_set("vector", np.zeros(2 * len(mesh.loops), np.float32))
    session.sync()
    session.start(dict(width=32, height=24, samples=4, seed=1, passes=["Combined"]))
    session.finish()
    return session.read("Combined").copy(), count
arrays.in_place = counted
copied, few = picture(0, False, False)
borrowed, many = picture(0, True, False)
spoiled, _ = picture(0, True, True)
show(same=[bool(np.array_equal(copied, other)) for other in (borrowed, spoiled)], bright=float(copied[..., :3].mean()),
     counts=[few, many])
""",
        tmp_path,
        fake=False,
        timeout=300,
    )
    assert facts["bright"] > 0.02
    assert facts["same"] == [True, True]
    few, many = facts["counts"]
    assert many > few + 15, "positions, corners, normals and UV maps"

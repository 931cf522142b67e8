# SPDX-License-Identifier: Apache-2.0
"""Syncs of a graph that tells what changed: however little is looked at, the scene is what a first sync would make."""

import json

import pytest
from bpy_process import run

pytest.importorskip("bpy")

# A scene with every way to make instances. `step(name, edit)` edits, lets the graph tell what changed, syncs with that,
# and compares with a fresh sync; it shows whether all instances were walked over, and what differs.
_SCENE = """
import importlib
module = lambda name: importlib.import_module(hb.MODULE + name)
state, instances = module(".sync.state"), module(".sync.instance")
walks = []
collect = state.instances.collect
def collected(*arguments):
    walks.append(1)
    return collect(*arguments)
state.instances.collect = collected
kept = state.SceneSync(core)
problems = []
def rows(fake):
    found = []
    for i in fake.instances.values():
        about = {k: v for k, v in i.items() if k not in ("mesh", "matrix", "materials", "moves")}
        mesh = fake.meshes[i["mesh"]]
        materials = [fake.materials[m]["name"] for m in i["materials"]]
        found.append(repr(("instance", sorted(about.items()), i["matrix"].tolist(), mesh["name"], materials,
                           mesh["positions"].tolist())))
    for l in fake.lights.values():
        found.append(repr(("light", sorted((k, v) for k, v in l.items() if k != "matrix"), l["matrix"].tolist())))
    found.append(repr(("world", fake.world)))
    return sorted(found)
def synced(_, graph):
    kept.sync(graph, True)
def step(name, edit):
    bpy.context.view_layer.update()
    walks.clear()
    bpy.app.handlers.depsgraph_update_post.append(synced)
    try: edit(); bpy.context.view_layer.update()
    finally: bpy.app.handlers.depsgraph_update_post.remove(synced)
    walked = len(walks)
    fresh = state.SceneSync(core)
    fresh.sync(bpy.context.evaluated_depsgraph_get(), False)
    have, want = rows(kept.scene), rows(fresh.scene)
    wrong = [row[:200] for row in set(have) ^ set(want)] + (["counts"] if len(have) != len(want) else [])
    show(**{name: {"walked": walked, "wrong": wrong, "instances": len(kept.scene.instances),
                   "edits": [edit for edit, _ in kept.scene.log]}})
    kept.scene.log = []

D, O = bpy.data, bpy.data.objects
cube, light, camera = O["Cube"], O["Light"], O["Camera"]
link = scene.collection.objects.link
def add(name, data=None):
    made = O.new(name, data)
    link(made)
    return made
def mesh(name, points, faces=((0, 1, 2),)):
    made = D.meshes.new(name)
    made.from_pydata(points, [], faces)
    return made
flat = mesh("flat", [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
plain, twin = add("plain", flat), add("twin", flat)
other = add("other", mesh("other", [(0, 0, 0), (2, 0, 0), (0, 2, 0)]))
child = add("child", flat); child.parent = cube
grandchild = add("grandchild", flat); grandchild.parent = child
bound = add("bound", flat); bound.constraints.new("COPY_LOCATION").target = cube
driven = add("driven", flat)
driver = driven.driver_add("location", 0).driver
variable = driver.variables.new(); variable.type = "TRANSFORMS"; variable.targets[0].id = cube
driver.expression = "var"
bent = add("bent", mesh("bent", [(0, 0, 0), (1, 0, 0), (0, 1, 0)]))
hook = bent.modifiers.new("c", "CAST"); hook.object = cube
inner = D.collections.new("inner"); part = O.new("part", flat); inner.objects.link(part)
lamp = O.new("lamp", D.lights.new("lamp", "POINT")); inner.objects.link(lamp)
rig = O.new("rig", None); inner.objects.link(rig)
held = O.new("held", flat); held.parent = rig; inner.objects.link(held)
place = add("place"); place.instance_type, place.instance_collection = "COLLECTION", inner
outer = D.collections.new("outer"); nested = O.new("nested", None); outer.objects.link(nested)
nested.instance_type, nested.instance_collection = "COLLECTION", inner
far = add("far"); far.instance_type, far.instance_collection = "COLLECTION", outer
seen_twice = O.new("seen twice", flat); link(seen_twice); inner.objects.link(seen_twice)
points = add("points", mesh("points", [(x, 9, 0) for x in range(4)], ())); points.instance_type = "VERTS"
leaf = add("leaf", flat); leaf.parent = points
group = D.node_groups.new("scatter", "GeometryNodeTree")
group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
on, info = group.nodes.new("GeometryNodeInstanceOnPoints"), group.nodes.new("GeometryNodeObjectInfo")
info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = other, True
info.transform_space = "RELATIVE"
group.links.new(start.outputs[0], on.inputs["Points"]); group.links.new(info.outputs["Geometry"], on.inputs["Instance"])
group.links.new(on.outputs[0], end.inputs[0])
scattered = add("scattered", mesh("scattered", [(x, 20, 0) for x in range(5)]))
scattered.modifiers.new("s", "NODES").node_group = group
emitter = add("emitter", mesh("emitter", [(0, 30, 0), (1, 30, 0), (0, 31, 0)]))
system = emitter.modifiers.new("p", "PARTICLE_SYSTEM").particle_system.settings
system.count, system.frame_start, system.frame_end, system.lifetime = 7, 0, 0, 100
system.render_type, system.instance_object = "OBJECT", plain
balls = [O.new("ball", D.metaballs.new("ball")), O.new("ball.001", D.metaballs.new("ball"))]
for ball in balls: ball.data.elements.new(); link(ball)
round_curve = add("curve", D.curves.new("curve", "CURVE")); round_curve.data.bevel_depth = 0.1
spline = round_curve.data.splines.new("POLY"); spline.points.add(3)
for i, point in enumerate(spline.points): point.co = (i, 40, 0, 1)
scene.frame_set(2)
bpy.context.view_layer.update()
kept.sync(bpy.context.evaluated_depsgraph_get(), False)
kept.scene.log = []
def x(*objects):
    for obj in objects: obj.location.x += 0.25
"""

# What edits, and whether no walk may be made for it (True), must be made (False) or either.
_STEPS = {
    "nothing but one": ("x(twin)", True),
    "two": ("x(twin, bound)", True),
    "a lamp": ("x(light)", True),
    "the camera": ("x(camera)", True),
    "parent, constraint and driver": ("x(child)", True),
    "rotated and mirrored": ("twin.rotation_euler.z += 1; twin.scale.x = -2", True),
    "no number": ("twin.location.x = float('nan')", True),
    "a number again": ("twin.location.x = 1", True),
    "with a colour": ("x(twin); twin.color = (1, 0, 0, 1)", False),
    "with a property of Cycles": ("x(twin); twin.cycles.shadow_terminator_geometry_offset = 0.3", True),
    "a lamp becomes a portal": ("x(light); light.data.cycles.is_portal = True", True),
    "a lamp no portal": ("x(light); light.data.cycles.is_portal = False", True),
    "a lamp's power": ("x(light); light.data.energy *= 2", False),
    "renamed": ("twin.name = 'other twin'; x(twin)", None),
    "renamed to another's": ("plain.name, twin.name = 'z', 'plain'; x(twin)", None),
    "what a modifier looks at": ("x(cube)", False),
    "instancer of a collection": ("x(place)", False),
    "instancer of an instancer": ("x(nested)", False),
    "outer instancer": ("x(far)", False),
    "in an instanced collection": ("x(part)", False),
    "lamp in an instanced collection": ("x(lamp)", False),
    "parent in an instanced collection": ("x(rig)", False),
    "in the scene and in a collection": ("x(seen_twice)", False),
    "instancer of vertices": ("x(points)", False),
    "child of one": ("x(leaf)", False),
    "instances of geometry nodes": ("x(other)", False),
    "geometry nodes themselves": ("x(scattered)", False),
    "what particles look like": ("x(plain)", False),
    "emitter": ("x(emitter)", False),
    "metaball": ("x(balls[1])", False),
    "curve": ("x(round_curve)", None),
    "shape": ("x(twin); flat.vertices[1].co.z += 1; flat.update()", False),
    "hidden with": ("x(twin); twin.hide_viewport = True", False),
    "moved while hidden": ("x(twin)", None),
    "shown with": ("x(twin); twin.hide_viewport = False", False),
    "another hidden": ("x(twin); bound.hide_set(True)", False),
    "another shown": ("x(twin); bound.hide_set(False)", False),
    "local exclusion": ("x(twin); bpy.context.view_layer.layer_collection.children[0].exclude = True", False),
    "and back": ("x(twin); bpy.context.view_layer.layer_collection.children[0].exclude = False", False),
    "indirect only": ("x(twin); bpy.context.view_layer.layer_collection.children[0].indirect_only = True", False),
    "rays": ("x(twin); twin.visible_glossy = False", False),
    "holdout": ("x(twin); twin.is_holdout = True", False),
    "index": ("x(twin); twin.pass_index = 5", False),
    "a slot": ("x(twin); flat.materials.append(D.materials['Material'])", False),
    "its material": ("x(twin); twin.material_slots[0].link = 'OBJECT'; twin.material_slots[0].material = None", False),
    "override": ("x(twin); bpy.context.view_layer.material_override = D.materials['Material']", False),
    "no override": ("x(twin); bpy.context.view_layer.material_override = None", False),
    "world": ("x(twin); scene.world.color = (1, 0, 0); scene.world = None", False),
    "another linked": ("x(twin); add('new', flat)", False),
    "another unlinked": ("x(twin); scene.collection.objects.unlink(O['new'])", False),
    "another removed": ("x(twin); O.remove(driven)", False),
    "swapped for another": ("x(twin); O.remove(bound); add('newer', flat)", False),
    "other data": ("x(twin); twin.data = other.data", False),
    "becomes an instancer": ("x(twin); twin.instance_type = 'VERTS'; child.parent = twin", False),
    "instancer moves": ("x(twin)", False),
    "no longer one": ("x(twin); twin.instance_type = 'NONE'", False),
    "moves after it": ("x(twin)", True),
    "modifier": ("x(twin); twin.modifiers.new('a', 'ARRAY')", False),
    "moves with a modifier": ("x(twin)", True),
    "another's count": ("x(twin); system.count = 3", False),
    "instances shown": ("x(twin); place.show_instancer_for_viewport = False", False),
    "of the same name, linked": (
        "path = tmp + '/twins.blend'; D.libraries.write(path, {twin})\n"
        "    with D.libraries.load(path, link=True) as (_, to): to.objects = ['plain']\n"
        "    global linked; linked = to.objects[0]; link(linked)",
        False,
    ),
    "it moves": ("x(linked); assert linked.name == twin.name", False),
    "offset of instances": ("x(twin); inner.instance_offset = (1, 0, 0)", False),
}  # fmt: skip


def test_a_sync_of_what_moved_is_a_sync_of_everything(tmp_path):
    steps = "\n".join(f"def edit():\n    {code}\nstep({json.dumps(name)}, edit)" for name, (code, _) in _STEPS.items())
    facts = run(_SCENE + steps, tmp_path)
    assert facts["nothing but one"]["instances"] > 35
    assert facts["nothing but one"]["edits"] == ["instance"] and facts["a lamp"]["edits"] == ["light"]
    wrong = {name: facts[name] for name in _STEPS if facts[name]["wrong"]}
    assert not wrong
    walks = {name: facts[name]["walked"] for name, (_, alone) in _STEPS.items() if alone is not None}
    assert walks == {name: int(not alone) for name, (_, alone) in _STEPS.items() if alone is not None}


def test_a_viewport_that_hides_objects_of_its_own_is_walked_and_so_is_what_comes_after(tmp_path):
    facts = run(
        _SCENE
        + """
space = next(s for w in bpy.data.screens for a in w.areas for s in a.spaces if s.type == "VIEW_3D")
def looked(here):
    def synced(_, graph):
        walks.clear()
        kept.sync(graph, True, space=here)
        found.append(len(walks))
    bpy.app.handlers.depsgraph_update_post.append(synced)
    x(twin)
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.remove(synced)
found = []
for here in (None, space, space, None, None): looked(here)
show(found=found)
""",
        tmp_path,
    )
    assert facts["found"] == [0, 1, 1, 1, 0]


def test_moves_that_waited_are_synced_together(tmp_path):
    """As a viewport does it while its scene is being rendered: updates are joined."""
    facts = run(
        _SCENE
        + """
from headwater_addon.sync.updates import Updates
waiting = []
def noted(_, graph): waiting.append(Updates(graph, True))
bpy.app.handlers.depsgraph_update_post.append(noted)
for edit in (lambda: x(twin), lambda: x(light), lambda: x(child)):
    edit(); bpy.context.view_layer.update()
def synced():
    joined = waiting[0]
    for later in waiting[1:]: joined = joined.joined(later)
    waiting.clear(); walks.clear(); kept.scene.log = []
    kept.sync(bpy.context.evaluated_depsgraph_get(), True, updates=joined)
    fresh = state.SceneSync(core); walked = len(walks)
    fresh.sync(bpy.context.evaluated_depsgraph_get(), False)
    return [walked, rows(kept.scene) == rows(fresh.scene), sorted(edit for edit, _ in kept.scene.log)]
show(moves=synced())
for edit in (lambda: x(twin), lambda: setattr(bound, "color", (1, 0, 0, 1)), lambda: x(child)):
    edit(); bpy.context.view_layer.update()
show(coloured=synced())
bound.hide_set(True); bpy.context.view_layer.update()
waiting[:] = [Updates.nothing()]
show(unsaid=synced())
""",
        tmp_path,
    )
    assert facts["moves"] == [0, True, ["instance", "instance", "instance", "light"]]  # a child's child too
    assert facts["coloured"][:2] == [1, True]
    assert facts["unsaid"][:2] == [1, True], "another number of instances is noticed in any case"

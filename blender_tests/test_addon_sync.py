# SPDX-License-Identifier: Apache-2.0
"""The add-on's sync in bpy: what the (fake) core's scene holds for meshes, instances, lights, cameras, bad input."""

import pytest
from bpy_process import run

pytest.importorskip("bpy")

SYNC = """
from headwater_addon.sync.state import SceneSync
state = SceneSync(core)
fake = state.scene
def sync(same_graph=False):
    fake.log = []
    graph = bpy.context.evaluated_depsgraph_get()
    report = state.sync(graph, same_graph)
    return [name for name, _ in fake.log]
def add(name, vertices, faces, **_):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj
def mesh_of(name):
    found = fake.named("instances", name)
    return fake.meshes[found[0]["mesh"]] if found else None
"""


def synced(code: str, tmp_path) -> dict:
    import textwrap

    return run(SYNC + textwrap.dedent(code), tmp_path)


def test_mesh_arrays(tmp_path):
    facts = synced(
        """
        cube = bpy.data.objects["Cube"]
        sync()
        flat = mesh_of("Cube")
        show(flat=[len(flat["positions"]), flat["triangles"], flat["normals"] is None, flat["tri_slots"] is None,
                   flat["default_uv"], list(flat["attributes"])])
        for polygon in cube.data.polygons: polygon.use_smooth = True
        cube.data.materials.append(bpy.data.materials.new("Second"))
        cube.data.polygons[2].material_index = 1
        cube.data.polygons[3].material_index = 7
        cube.data.update()
        edits = sync()
        smooth = mesh_of("Cube")
        normals = smooth["normals"]
        centre = smooth["positions"].mean(axis=0)
        corner_position = np.empty((24, 3), np.float32)
        corner_position[np.arange(24)] = smooth["positions"][[l.vertex_index for l in cube.data.loops]]
        away = (normals * (corner_position - centre)).sum(axis=1)
        show(edits=edits, slots=np.bincount(smooth["tri_slots"]).tolist(), away=float(away.min()),
             length=float(abs((normals ** 2).sum(axis=1) - 1).max()),
             materials=[fake.materials[m]["name"] for m in fake.named("instances", "Cube")[0]["materials"]])
        """,
        tmp_path,
    )
    assert facts["flat"] == [8, 12, True, True, 0, ["UVMap"]]
    assert facts["edits"].count("mesh") == 1
    # The face with a slot that does not exist takes the last one.
    assert facts["slots"] == [8, 4]
    assert facts["away"] > 0 and facts["length"] < 1e-5
    assert facts["materials"] == ["Material", "Second"]


def test_triangles_cover_faces_of_any_size(tmp_path):
    facts = synced(
        """
        import math
        ring = [(math.cos(i / 9 * math.tau), math.sin(i / 9 * math.tau), 0) for i in range(9)]
        add("mixed", ring + [(0, 0, 1), (2, 0, 1), (2, 1, 1)], [tuple(range(9)), (9, 10, 11), (0, 1, 10, 9)])
        sync()
        mesh = mesh_of("mixed")
        p = mesh["positions"][mesh["tri_vertices"]]
        area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
        show(triangles=mesh["triangles"], ngon=float(area[:7].sum()), wanted=9 / 2 * math.sin(math.tau / 9))
        """,
        tmp_path,
    )
    assert facts["triangles"] == 7 + 1 + 2
    assert facts["ngon"] == pytest.approx(facts["wanted"], rel=1e-5)


def test_normals_are_sent_one_a_vertex_where_corners_have_nothing_of_their_own(tmp_path):
    facts = synced(
        """
        def sphere(name, smooth=True, uv=False, sharp=False):
            bpy.ops.mesh.primitive_uv_sphere_add()
            made = bpy.context.object
            made.name, mesh = name, made.data
            if not uv: mesh.uv_layers.remove(mesh.uv_layers[0])
            mesh.shade_smooth() if smooth else mesh.shade_flat()
            if sharp: mesh.edges[40].use_edge_sharp = True
            mesh.update()
            return made
        made = [sphere("smooth"), sphere("flat", smooth=False), sphere("uv", uv=True), sphere("sharp", sharp=True),
                sphere("custom")]
        custom = made[-1].data
        custom.normals_split_custom_set([(0, 0, 1)] * len(custom.loops))
        points = made[0].data
        if bpy.app.version >= (5, 0):  # normals of one's own at vertices
            own = points.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
            own.data.foreach_set("vector", np.tile(np.float32([0, 0, 1]), len(points.vertices)))
            points.update()
        sync()
        for obj in made:
            mesh, sent = obj.data, mesh_of(obj.name)
            shape = None if sent["normals"] is None else len(sent["normals"])
            corners = sent["tri_corners"] if sent["tri_corners"] is not None else sent["tri_vertices"]
            wanted = np.array([mesh.corner_normals[i].vector for t in mesh.loop_triangles for i in t.loops])
            off = None if shape is None else float(abs(sent["normals"][corners].reshape(-1, 3) - wanted).max())
            kinds = [shape == len(mesh.vertices), shape == len(mesh.loops), sent["tri_corners"] is None]
            show(**{obj.name: [*kinds, off]}, domain=mesh.normals_domain)
        """,
        tmp_path,
    )
    assert facts["smooth"] == [True, False, True, 0]
    assert facts["flat"] == [False, False, True, None]
    for name in ("uv", "sharp", "custom"):
        assert facts[name] == [False, True, False, 0]


def test_arrays_are_read_in_place_only_where_they_lie_one_behind_the_other(tmp_path):
    facts = run(
        """
        from headwater_addon.sync.arrays import in_place
        bpy.ops.mesh.primitive_uv_sphere_add(); mesh = bpy.context.object.data
        triangles = mesh.loop_triangles
        count = len(triangles)
        read = np.empty((count, 3), np.int32); triangles.foreach_get("loops", read.reshape(-1))
        found = in_place(triangles, "loops", count, 3, np.int32)
        show(same=bool(np.array_equal(found, read)), locked=not found.flags.writeable)
        class Triangle:
            def __init__(self, at, loops): self.at, self.loops = at, loops
            def as_pointer(self): return self.at
        start = triangles[0].as_pointer()
        apart = [Triangle(start + 24 * i, tuple(read[i])) for i in range(count)]
        others = [Triangle(start + 12 * i, (7, 7, 7) if i == count - 1 else tuple(read[i])) for i in range(count)]
        right = [Triangle(start + 12 * i, tuple(read[i])) for i in range(count)]
        show(kinds=[in_place(c, "loops", count, 3, np.int32) is None for c in (apart, others, right)])
        """,
        tmp_path,
    )
    assert facts["same"] and facts["locked"]
    assert facts["kinds"] == [True, True, False]


def test_material_slots_linked_to_object_or_data(tmp_path):
    facts = synced(
        """
        cube = bpy.data.objects["Cube"]
        other = bpy.data.objects.new("Other", cube.data)
        scene.collection.objects.link(other)
        other.material_slots[0].link = "OBJECT"
        other.material_slots[0].material = bpy.data.materials.new("Own")
        bare = bpy.data.objects.new("Bare", cube.data)
        scene.collection.objects.link(bare)
        bare.material_slots[0].link = "OBJECT"
        bare.material_slots[0].material = None
        sync()
        def names(name):
            return [fake.materials[m]["name"] if m else None for m in fake.named("instances", name)[0]["materials"]]
        show(cube=names("Cube"), other=names("Other"), bare=names("Bare"), meshes=len(fake.meshes))
        """,
        tmp_path,
    )
    assert (
        facts["cube"] == ["Material"] and facts["other"] == ["Own"] and facts["bare"] == ["Material"]
    )  # as Blender: an empty slot falls back to the data
    assert facts["meshes"] == 1  # linked duplicates share their mesh


def test_every_kind_of_geometry_becomes_one_mesh(tmp_path):
    facts = synced(
        """
        bpy.ops.curve.primitive_bezier_circle_add(); bpy.context.object.name = "curve"
        bpy.context.object.data.bevel_depth = 0.1
        bpy.ops.curve.primitive_bezier_circle_add(); bpy.context.object.name = "wire"
        bpy.ops.object.text_add(); bpy.context.object.name = "text"
        bpy.ops.surface.primitive_nurbs_surface_sphere_add(); bpy.context.object.name = "surface"
        bpy.ops.object.metaball_add(); bpy.context.object.name = "meta"
        bpy.ops.object.metaball_add(location=(1, 0, 0)); bpy.context.object.name = "meta.001"
        bpy.ops.mesh.primitive_cube_add(); bpy.context.object.name = "modified"
        bpy.context.object.modifiers.new("s", "SUBSURF").render_levels = 2
        sync()
        show(counts={n: len(fake.named("instances", n)) for n in
                     ("curve", "wire", "text", "surface", "meta", "meta.001", "modified")},
             triangles={n: mesh_of(n)["triangles"] for n in ("curve", "text", "surface", "meta", "modified")})
        """,
        tmp_path,
    )
    assert facts["counts"] == {
        "curve": 1, "wire": 0, "text": 1, "surface": 1, "meta": 1, "meta.001": 0, "modified": 1,
    }  # fmt: skip
    assert all(count > 10 for count in facts["triangles"].values())
    assert facts["triangles"]["modified"] > 12


GEOMETRY_NODES = """
def scatter(points, instance):
    group = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    on = group.nodes.new("GeometryNodeInstanceOnPoints")
    if instance is None:
        what = group.nodes.new("GeometryNodeMeshCone").outputs["Mesh"]
    else:
        node = group.nodes.new("GeometryNodeObjectInfo")
        node.inputs["Object"].default_value = instance
        node.inputs["As Instance"].default_value = True
        what = node.outputs["Geometry"]
    group.links.new(start.outputs[0], on.inputs["Points"])
    group.links.new(what, on.inputs["Instance"])
    group.links.new(on.outputs[0], end.inputs[0])
    points.modifiers.new("scatter", "NODES").node_group = group
"""


def test_instances_of_every_instancer_share_meshes(tmp_path):
    facts = synced(
        GEOMETRY_NODES
        + """
cube = bpy.data.objects["Cube"]
inside = bpy.data.collections.new("inside")
part = add("part", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
scene.collection.objects.unlink(part)
inside.objects.link(part)
for i in range(3):
    empty = bpy.data.objects.new(f"copy{i}", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inside
    empty.location = (i, 10, 0)
    scene.collection.objects.link(empty)
grid = add("grid", [(x, 20, 0) for x in range(5)] + [(0, 21, 0)], [(0, 1, 5)])
scatter(grid, cube)
cones = add("cones", [(x, 30, 0) for x in range(4)], [(0, 1, 2)])
scatter(cones, None)
bpy.ops.mesh.primitive_plane_add(); emitter = bpy.context.object
system = emitter.modifiers.new("p", "PARTICLE_SYSTEM").particle_system.settings
system.count, system.frame_start, system.frame_end, system.lifetime = 20, 0, 0, 100
system.render_type, system.instance_object = "OBJECT", part
emitter.show_instancer_for_viewport = False
emitter.name = "emitter"
hidden = add("hidden", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
hidden.hide_render = hidden.hide_viewport = True
scene.frame_set(2)
edits = sync()
parts = fake.named("instances", "part")
cubes = fake.named("instances", "Cube")
cone = [i for i in fake.named("instances", "cones")]
again = sync()
show(parts=len(parts), part_meshes=len({i["mesh"] for i in parts}), cubes=len(cubes),
     cube_meshes=len({i["mesh"] for i in cubes}), cones=len(cone), cone_meshes=len({i["mesh"] for i in cone}),
     ids=len({i["random_id"] for i in cubes}), hidden=len(fake.named("instances", "hidden")),
     emitter=len(fake.named("instances", "emitter")),
     at=sorted(float(i["matrix"][0][3]) for i in cubes if i["matrix"][1][3] > 15), batches=edits.count("instances"),
     again=again)
""",
        tmp_path,
    )
    assert facts["parts"] == 3 + 20 and facts["part_meshes"] == 1
    assert facts["cubes"] == 1 + 6 and facts["cube_meshes"] == 1
    assert facts["at"] == [0, 0, 1, 2, 3, 4]
    assert facts["cones"] == 4 and facts["cone_meshes"] == 1
    assert facts["ids"] == 7  # each copy has its own random number
    assert facts["hidden"] == 0 and facts["emitter"] == 0
    assert facts["again"] == []


def test_only_what_changed_is_sent(tmp_path):
    facts = synced(
        """
        cube = bpy.data.objects["Cube"]
        other = add("other", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
        result = {"first": sync()}
        result["nothing"] = sync()
        cube.location.x = 5
        result["moved"] = sync()
        other.data.vertices[1].co.z = 3; other.data.update()
        result["deformed"] = sync()
        bpy.data.objects["Light"].data.energy *= 2
        result["brighter"] = sync()
        bpy.data.objects.remove(other)
        result["removed"] = sync()
        cube.hide_viewport = True
        result["hidden"] = sync()
        cube.hide_viewport = False
        result["shown"] = sync()
        show(**result)
        """,
        tmp_path,
    )
    assert facts["nothing"] == []
    assert facts["moved"] == ["instance"]
    assert facts["deformed"] == ["mesh"]
    assert facts["brighter"] == ["light"]
    assert facts["removed"][:2] == ["remove_instances", "remove_mesh"]
    assert facts["hidden"][:2] == ["remove_instances", "remove_mesh"]
    assert facts["shown"].count("mesh") == 1 and facts["shown"].count("instance") == 1


def test_tangents_are_asked_for_of_the_maps_that_normal_maps_name(tmp_path):
    facts = synced(
        """
        cube = bpy.data.objects["Cube"]
        cube.data.uv_layers.new(name="Second").active_render = False
        material = cube.data.materials[0]
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        def bend(uv_map):
            node = nodes.new("ShaderNodeNormalMap")
            node.uv_map = uv_map
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Position"], node.inputs["Color"])
            links.new(node.outputs["Normal"], nodes["Principled BSDF"].inputs["Normal"])
        def asked():
            sent = mesh_of("Cube")
            names = list(sent["attributes"])
            return [[name, names[uv]] for name, uv in sent["tangents"]]
        sync()
        none = asked()
        bend("")
        edits = sync()
        default, again = asked(), sync()
        bend("Second")
        sync()
        second = asked()
        cube.data.uv_layers["Second"].data[3].uv.x += 0.5
        cube.data.update()
        moved = sync()
        # No room: eight attributes that the material reads.
        for i in range(6):
            cube.data.attributes.new(f"a{i}", "FLOAT", "POINT")
            node = nodes.new("ShaderNodeAttribute")
            node.attribute_name = f"a{i}"
            add = nodes.new("ShaderNodeMath")
            links.new(node.outputs["Fac"], add.inputs[0])
            links.new(add.inputs[1], nodes["Principled BSDF"].inputs["Roughness"].links[0].from_socket
                      if nodes["Principled BSDF"].inputs["Roughness"].is_linked else node.outputs["Fac"])
            links.new(add.outputs[0], nodes["Principled BSDF"].inputs["Roughness"])
        state.notes.take()
        sync()
        show(none=none, edits=edits, default=default, again=again, second=second, moved=moved, full=asked(),
             notes=state.notes.take())
        """,
        tmp_path,
    )
    assert facts["none"] == [] and facts["default"] == [[".tangent", "UVMap"]], facts
    assert "mesh" in facts["edits"] and facts["again"] == []
    assert facts["second"] == [["Second.tangent", "Second"]]
    assert facts["moved"] == ["mesh"]
    assert facts["full"] == [] and "no room for the tangents" in "".join(facts["notes"]), facts


@pytest.mark.parametrize("persistent", [False, True])
def test_deforming_meshes_are_sent_every_frame_and_keep_their_id(tmp_path, persistent):
    facts = run(
        f"""
        bpy.ops.mesh.primitive_cube_add(location=(4, 0, 0)); still = bpy.context.object
        cube = bpy.data.objects["Cube"]
        cube.shape_key_add(name="Basis")
        key = cube.shape_key_add(name="up")
        key.data[0].co.z += 2
        key.value = 0; key.keyframe_insert("value", frame=1)
        key.value = 1; key.keyframe_insert("value", frame=4)
        bpy.ops.object.armature_add(); rig = bpy.context.object
        bpy.ops.mesh.primitive_cylinder_add(location=(0, 4, 0)); skinned = bpy.context.object
        skinned.modifiers.new("a", "ARMATURE").object = rig
        group = skinned.vertex_groups.new(name="Bone"); group.add(range(32), 1.0, "REPLACE")
        bone = rig.pose.bones["Bone"]
        bone.keyframe_insert("location", frame=1); bone.location.x = 1; bone.keyframe_insert("location", frame=4)
        scene.frame_start, scene.frame_end = 1, 3
        scene.render.use_persistent_data = {persistent}
        bpy.ops.render.render(animation=True)
        edits = core.sessions[-1].edits
        names = [[core.sessions[-1].scene.meshes[i]["name"] for n, i in frame if n == "mesh"] for frame in edits]
        show(names=names, instances=[[n for n, i in frame if n != "mesh"] for frame in edits[1:]],
             ids=[sorted(i for n, i in frame if n == "mesh") for frame in edits])
        """,
        tmp_path,
    )
    first, second, third = (sorted(names) for names in facts["names"])
    assert len(first) == 3
    assert len(second) == len(third) == 2 and second == third
    assert facts["ids"][1] == facts["ids"][2] and set(facts["ids"][1]) < set(facts["ids"][0])
    assert facts["instances"] == [[], []]


def test_bad_geometry_is_left_out_with_a_note(tmp_path):
    facts = synced(
        """
        add("empty", [], [])
        add("loose", [(0, 0, 0), (1, 0, 0)], [])
        nan = float("nan")
        add("broken", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (nan, 0, 0)], [(0, 1, 2), (1, 2, 3)])
        add("lost", [(nan, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
        add("sliver", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
        flat = add("flat", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]); flat.scale = (1, 0, 1)
        mirrored = add("mirrored", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]); mirrored.scale = (-1, 1, 1)
        nowhere = add("nowhere", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]); nowhere.location.x = nan
        sync()
        show(counts={n: len(fake.named("instances", n)) for n in
                     ("empty", "loose", "broken", "lost", "sliver", "flat", "mirrored", "nowhere")},
             broken=mesh_of("broken")["triangles"], notes=state.notes.take(), told=state.notes.take())
        """,
        tmp_path,
    )
    assert facts["counts"] == {
        "empty": 0, "loose": 0, "broken": 1, "lost": 0, "sliver": 1, "flat": 1, "mirrored": 1, "nowhere": 0,
    }  # fmt: skip
    assert facts["broken"] == 1
    text = "\\n".join(facts["notes"])
    assert "broken" in text and "lost" in text and "nowhere" in text
    assert facts["told"] == []


def test_camera_plane_is_blenders_projection(tmp_path):
    """The rectangle must be that of Object.calc_matrix_camera, for every kind of fit, shift and pixel aspect."""
    facts = run(
        """
        import itertools, types
        from headwater_addon.sync.camera import picture_plane
        camera = bpy.data.cameras[0]
        graph = bpy.context.evaluated_depsgraph_get()
        obj = bpy.data.objects["Camera"]
        worst, count = 0.0, 0
        for kind, fit, (w, h), aspect, shift in itertools.product(
            ("PERSP", "ORTHO"), ("AUTO", "HORIZONTAL", "VERTICAL"), ((320, 200), (200, 320), (100, 100)),
            ((1, 1), (2, 1), (1, 1.5)), ((0, 0), (0.2, -0.3))):
            camera.type, camera.sensor_fit = kind, fit
            camera.shift_x, camera.shift_y = shift
            camera.sensor_width, camera.sensor_height, camera.lens, camera.ortho_scale = 36, 20, 45, 7
            bpy.context.view_layer.update()
            matrix = np.array(obj.calc_matrix_camera(graph, x=w, y=h, scale_x=aspect[0], scale_y=aspect[1]))
            left, right, bottom, top = picture_plane(camera, w * aspect[0], h * aspect[1])
            for x, y, sx, sy in ((left, bottom, -1, -1), (right, top, 1, 1)):
                clip = matrix @ np.array([x, y, -1.0, 1.0])
                worst = max(worst, abs(clip[0] / clip[3] - sx), abs(clip[1] / clip[3] - sy))
                count += 1
        show(worst=float(worst), count=count)
        """,
        tmp_path,
    )
    assert facts["count"] == 216 and facts["worst"] < 1e-4


def test_camera_depth_of_field_scale_and_panorama(tmp_path):
    facts = run(
        """
        from headwater_addon.sync.camera import CameraSync
        from headwater_addon.sync.problems import Notes
        from headwater_addon.render_settings import frame_of
        fake, notes = core.Scene(), Notes()
        obj = bpy.data.objects["Camera"]
        obj.matrix_world.identity()
        obj.location, obj.rotation_euler, obj.scale = (0, 0, 10), (0, 0, 0), (2, 2, 3)
        camera = obj.data
        camera.dof.use_dof, camera.dof.aperture_fstop, camera.lens = True, 2.0, 50
        camera.dof.focus_object = bpy.data.objects["Cube"]
        bpy.data.objects["Cube"].location = (5, 0, 3)
        def sync():
            graph = bpy.context.evaluated_depsgraph_get()
            frame = frame_of(scene.render)
            CameraSync(fake, notes).sync(graph, obj.evaluated_get(graph), scene.render, frame)
            return {k: (v.tolist() if hasattr(v, "tolist") else v) for k, v in fake.camera.items()}
        bpy.context.view_layer.update()
        show(persp=sync())
        camera.type = "ORTHO"
        show(ortho=sync())
        camera.type = "PANO"
        if hasattr(camera, "panorama_type"):
            camera.panorama_type = "EQUIRECTANGULAR"
        show(pano=sync(), notes=notes.take())
        if hasattr(camera, "panorama_type"):
            camera.panorama_type, camera.fisheye_fov = "FISHEYE_EQUIDISTANT", 2.5
            show(fisheye=sync(), silent=notes.take())
            camera.panorama_type = "FISHEYE_LENS_POLYNOMIAL"
            camera.fisheye_polynomial_k0, camera.fisheye_polynomial_k3 = 0.25, 0.5
            show(polynomial=sync(), said=notes.take())
        """,
        tmp_path,
    )
    persp = facts["persp"]
    assert persp["aperture_radius"] == pytest.approx(0.05 / 4) and persp["focus_distance"] == pytest.approx(7)
    assert persp["matrix"] == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 10]]  # the object's scale is no part of it
    assert facts["ortho"]["kind"] == "orthographic" and facts["ortho"]["aperture_radius"] == pytest.approx(0.25)
    assert facts["pano"]["kind"] == "panoramic" and facts["notes"] == []
    assert facts["pano"]["aperture_radius"] == persp["aperture_radius"]
    if "fisheye" in facts:
        assert facts["fisheye"]["panorama"] == "fisheye_equidistant" and facts["silent"] == []
        assert facts["fisheye"]["range"][0] == pytest.approx(2.5)
        polynomial = facts["polynomial"]
        assert polynomial["panorama"] == "fisheye_polynomial" and facts["said"] == []
        assert polynomial["range"][:3] == pytest.approx([2.5, 0.25, 36]) and polynomial["lens"][2] == 0.5


def test_lights(tmp_path):
    facts = synced(
        """
        def light(name, kind, **properties):
            data = bpy.data.lights.new(name, kind)
            for key, value in properties.items(): setattr(data, key, value)
            obj = bpy.data.objects.new(name, data)
            scene.collection.objects.link(obj)
            return obj
        bpy.data.objects.remove(bpy.data.objects["Light"])
        light("point", "POINT", energy=40, shadow_soft_size=0.3, color=(1, 0.5, 0.25), use_soft_falloff=True)
        light("hard", "POINT", use_soft_falloff=False, use_shadow=False)
        light("spot", "SPOT", spot_size=1.0, spot_blend=0.3)
        light("sun", "SUN", angle=0.1, energy=3)
        light("disk", "AREA", shape="DISK", size=2, size_y=5, spread=1.5)
        light("rectangle", "AREA", shape="RECTANGLE", size=2, size_y=5)
        warm = light("warm", "POINT")
        if hasattr(warm.data, "use_temperature"):
            warm.data.use_temperature, warm.data.temperature = True, 3000
        if hasattr(warm.data, "exposure"):
            warm.data.exposure = 1
        unseen = light("unseen", "POINT"); unseen.visible_camera = False
        unseen.data.cycles.use_multiple_importance_sampling = False
        portal = light("portal", "AREA"); portal.data.cycles.is_portal = True
        inside = bpy.data.collections.new("inside")
        lamp = light("lamp", "POINT"); scene.collection.objects.unlink(lamp); inside.objects.link(lamp)
        for i in range(3):
            empty = bpy.data.objects.new(f"copy{i}", None)
            empty.instance_type, empty.instance_collection = "COLLECTION", inside
            empty.location.x = i
            scene.collection.objects.link(empty)
        sync()
        lights = {}
        for l in fake.lights.values():
            lights.setdefault(l["name"], []).append({k: v for k, v in l.items() if k != "matrix"})
        show(lights=lights, flags=core.flags, xs=sorted(float(l["matrix"][0][3]) for l in fake.named("lights", "lamp")),
             again=sync(), temperature=hasattr(warm.data, "use_temperature"))
        """,
        tmp_path,
    )
    lights, flags = facts["lights"], facts["flags"]
    point = lights["point"][0]
    assert point["power"] == 40 and point["radius"] == pytest.approx(0.3) and point["color"] == [1, 0.5, 0.25]
    assert point["flags"] & flags["HW_LIGHT_SOFT_FALLOFF"] and point["flags"] & flags["HW_LIGHT_CAST_SHADOW"]
    hard = lights["hard"][0]["flags"]
    assert not hard & flags["HW_LIGHT_SOFT_FALLOFF"] and not hard & flags["HW_LIGHT_CAST_SHADOW"]
    assert lights["spot"][0]["spot_size"] == pytest.approx(1) and lights["spot"][0]["spot_blend"] == pytest.approx(0.3)
    assert lights["sun"][0]["angle"] == pytest.approx(0.1) and lights["sun"][0]["power"] == 3
    disk, rectangle = lights["disk"][0], lights["rectangle"][0]
    assert (disk["size_x"], disk["size_y"], disk["ellipse"]) == (2, 2, True) and disk["spread"] == pytest.approx(1.5)
    assert (rectangle["size_x"], rectangle["size_y"], rectangle["ellipse"]) == (2, 5, False)
    if facts["temperature"]:
        red, green, blue = lights["warm"][0]["color"]
        assert red > 2 * green > 2 * blue
    unseen = lights["unseen"][0]["flags"]
    assert not unseen & flags["HW_LIGHT_CAMERA"] and not unseen & flags["HW_LIGHT_USE_MIS"]
    assert "portal" not in lights
    assert facts["xs"] == [0, 1, 2] and len(lights["lamp"]) == 3
    assert facts["again"] == []


def test_of_many_lamps_only_those_that_changed_are_sent(tmp_path):
    facts = synced(
        """
        lamp = bpy.data.objects["Light"]
        holder = add("holder", [(x, 0, 1) for x in range(200)], [])
        holder.instance_type = "VERTS"
        inner = bpy.data.objects.new("Inner", bpy.data.lights.new("Inner", "SPOT"))
        scene.collection.objects.link(inner)
        inner.parent = holder
        calls = []
        for name in ("upsert_lights", "remove_lights"):
            def counted(*arguments, call=getattr(fake, name), name=name, **settings):
                calls.append([name, len(arguments[0])])
                call(*arguments, **settings)
            setattr(fake, name, counted)
        def step(name, edit=lambda: None):
            edit()
            calls.clear()
            sync()
            where = sorted(round(float(l["matrix"][0][3]), 3) for l in fake.named("lights", "Inner"))
            wanted = sorted(round(v.co.x, 3) for v in holder.data.vertices if v.co.x == v.co.x)
            show(**{name: [sorted(calls), where == sorted([0.0, *wanted])]})  # Blender shows the child itself too
        def moved():
            for i in (3, 70, 199): holder.data.vertices[i].co.x += 0.5
            holder.data.update()
        def grown():
            holder.data.vertices.add(5); holder.data.update()
        def shrunk():
            kept = [v.co.copy() for v in holder.data.vertices][:190]
            holder.data.clear_geometry(); holder.data.from_pydata(kept, [], []); holder.data.update()
        def lost():
            holder.data.vertices[5].co.x = float("nan"); holder.data.update()
        step("first"); step("again"); step("moved", moved); step("grown", grown)
        before = set(fake.lights)
        step("shrunk", shrunk)
        gone = before - set(fake.lights)
        step("regrown", grown)
        show(reused=len(gone & set(fake.lights)))
        step("brighter", lambda: setattr(inner.data, "energy", 7))
        step("lamp", lambda: setattr(lamp.location, "x", 1))
        state.notes.take()
        step("lost", lost)
        show(notes=state.notes.take())
        bpy.data.objects.remove(inner)
        calls.clear(); sync(); show(gone=[sorted(calls), len(fake.lights)])
        """,
        tmp_path,
    )
    send, remove = "upsert_lights", "remove_lights"
    assert facts["first"] == [[[send, 1], [send, 1], [send, 200]], True]
    assert facts["again"] == [[], True]
    assert facts["moved"] == [[[send, 3]], True]
    assert facts["grown"] == [[[send, 5]], True]
    assert facts["shrunk"] == [[[remove, 15]], True]
    assert facts["regrown"] == [[[send, 5]], True]
    assert facts["reused"] == 0, "what is kept over frames knows a lamp by its id"
    assert facts["brighter"] == [[[send, 1], [send, 195]], True]
    assert facts["lamp"] == [[[send, 1]], True]
    assert facts["lost"] == [[[remove, 1]], True] and "Inner" in facts["notes"][0]
    assert facts["gone"] == [[[remove, 1], [remove, 194]], 1]


def test_a_refused_lamp_is_named(tmp_path):
    facts = synced(
        """
        def refuse(*_, **__): raise core.SceneError("no more lamps")
        fake.upsert_lights = refuse
        try: sync()
        except Exception as error: show(error=f"{type(error).__name__} {error}")
        """,
        tmp_path,
    )
    assert facts["error"] == "SyncError Light 'Light': no more lamps"


def test_ray_visibility_of_object_and_instancer(tmp_path):
    facts = synced(
        """
        cube = bpy.data.objects["Cube"]
        cube.visible_glossy = False
        cube.pass_index, cube.color = 7, (0.1, 0.2, 0.3, 1)
        inside = bpy.data.collections.new("inside"); inside.objects.link(cube)
        empty = bpy.data.objects.new("copy", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.visible_shadow = False
        scene.collection.objects.link(empty)
        sync()
        found = sorted(i["visibility"] for i in fake.named("instances", "Cube"))
        show(found=found, flags=core.flags, index=fake.named("instances", "Cube")[0]["object_index"],
             color=fake.named("instances", "Cube")[0]["color"])
        """,
        tmp_path,
    )
    flags = facts["flags"]
    all_rays = sum(flags[f"HW_MASK_{r}"] for r in ("CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION", "SHADOW_OPAQUE"))
    own = all_rays - flags["HW_MASK_GLOSSY"]
    assert facts["found"] == sorted([own, own - flags["HW_MASK_SHADOW_OPAQUE"]])
    assert facts["index"] == 7 and facts["color"] == pytest.approx([0.1, 0.2, 0.3])


def test_slots_keep_the_place_of_known_instances(tmp_path):
    facts = run(
        """
        from headwater_addon.sync.instance import assign_slots, hash_rows
        u = lambda *v: np.array(v, np.uint64)
        gone = assign_slots(u(10, 11, 12, 13), np.arange(4), u(11, 13), 4)
        born = assign_slots(u(11, 13), np.array([1, 3]), u(20, 11, 13, 21, 22), 4)
        twice = assign_slots(u(5, 5), np.arange(2), u(5, 5, 5), 2)
        rows = np.random.default_rng(1).integers(-2**31, 2**31, (50000, 8), dtype=np.int32)
        show(gone=[gone[0].tolist(), gone[1]], born=[born[0].tolist(), born[1]],
             twice=[sorted(twice[0].tolist()), twice[1]],
             different=len(np.unique(hash_rows(rows))), same=bool((hash_rows(rows) == hash_rows(rows.copy())).all()),
             )
        """,
        tmp_path,
    )
    assert facts["gone"] == [[1, 3], 4]
    assert facts["born"] == [[0, 1, 3, 2, 4], 5]
    assert facts["twice"] == [[0, 1, 2], 3]
    assert facts["different"] == 50000 and facts["same"]


def test_particles_that_die_keep_the_others_in_place(tmp_path):
    facts = synced(
        """
        part = bpy.data.objects["Cube"]
        bpy.ops.mesh.primitive_plane_add(); emitter = bpy.context.object
        system = emitter.modifiers.new("p", "PARTICLE_SYSTEM").particle_system.settings
        system.count, system.frame_start, system.frame_end, system.lifetime = 30, 1, 10, 5
        system.render_type, system.instance_object = "OBJECT", part
        counts = []
        for frame in range(1, 14):
            scene.frame_set(frame)
            sync()
            counts.append(len(fake.named("instances", "Cube")))
        show(counts=counts)
        """,
        tmp_path,
    )
    counts = facts["counts"]
    assert max(counts) > min(counts) >= 1 and counts[5] > counts[0]


@pytest.mark.alone
@pytest.mark.slow
def test_a_million_instances(tmp_path):
    facts = synced(
        GEOMETRY_NODES
        + """
import time
bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=100)
scatter(bpy.context.object, bpy.data.objects["Cube"])
seen = []
fake.upsert_instances = lambda first, mesh, matrices, **settings: seen.append(len(matrices))
start = time.time(); sync()
show(count=max(seen), seconds=time.time() - start)
""",
        tmp_path,
    )
    assert facts["count"] > 1_000_000
    assert facts["seconds"] < 30


def test_object_settings_that_are_not_followed_are_said(tmp_path):
    facts = run(
        """
        from headwater_addon.sync.state import SceneSync
        def notes():
            sync = SceneSync(core)
            sync.sync(bpy.context.evaluated_depsgraph_get(), False)
            return [(str(note), note.kind, note.name) for note in sync.notes.take()]
        before = notes()
        bpy.data.objects["Cube"].is_shadow_catcher = True
        bpy.data.objects["Light"].light_linking.receiver_collection = bpy.data.collections.new("lit")
        bpy.context.view_layer.update()
        show(before=before, after=notes())
        """,
        tmp_path,
    )
    assert facts["before"] == []
    (catcher, linked) = sorted(facts["after"], key=lambda note: note[1], reverse=True)
    assert catcher[1:] == ["Object", "Cube"] and "shadow catcher" in catcher[0]
    assert linked[1:] == ["Light", "Light"] and "light linking" in linked[0]

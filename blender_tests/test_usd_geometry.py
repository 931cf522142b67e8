# SPDX-License-Identifier: Apache-2.0
"""USD geometry as scene edits, against a recording double of the core: meshes, instances, cameras, skinning, time."""

import math

import fake_core
import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from headwater.errors import UserError
from headwater.usd_scene import StageSync, open_stage
from headwater.usd_scene.triangulate import clip_ears, triangulate


def stage_file(tmp_path, up="Z", metres=1.0, name="scene.usda"):
    """A new stage that will be saved at a path."""
    path = str(tmp_path / name)
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    return stage, path


def synced(stage, path, frame=1.0, scene=None, sync=None, **options):
    """The recording scene after a sync of the saved stage, and the sync."""
    stage.GetRootLayer().Save()
    if sync is None:
        scene = fake_core.Scene()
        sync = StageSync(open_stage(path), scene, flags=fake_core.flags)
    sync.sync(frame, aspect=options.pop("aspect", 1.0), **options)
    return sync.scene, sync


def quad(stage, path="/quad", size=1.0):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (size, 0, 0), (size, size, 0), (0, size, 0)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def area(mesh):
    corners = mesh["positions"][mesh["tri_vertices"]].astype(float)
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


def normals_of(mesh):
    corners = mesh["positions"][mesh["tri_vertices"]].astype(float)
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


# Triangulation


def test_concave_polygon_keeps_its_area_and_facing():
    points = np.array([(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0)], float)  # an M
    triangles, faces = triangulate([5], points)
    corners = points[triangles]
    signed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert (signed > 0).all()
    assert signed.sum() == pytest.approx(10)
    assert list(faces) == [0, 0, 0]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("flip", [False, True])
def test_concave_quad_in_every_plane(axis, flip):
    flat = np.array([(0, 0), (3, 1), (0, 3), (1, 1)], float)[:: -1 if flip else 1]  # a dart
    points = np.insert(flat, axis, 0.5, axis=1)
    triangles, _ = triangulate([4], points)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(3)
    assert np.abs(normals.sum(axis=0)).sum() / 2 == pytest.approx(3), "both triangles face one way"


def test_ears_of_random_star_polygons_cover_them():
    rng = np.random.default_rng(5)
    for corners in (6, 9, 17):
        angles = np.sort(rng.random(corners)) * 2 * math.pi
        radius = 0.3 + rng.random(corners)
        points = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(corners)], axis=1)
        expected = abs(np.cross(points, np.roll(points, -1, axis=0))[:, 2].sum()) / 2
        chosen = points[clip_ears(points)]
        found = np.cross(chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0])[:, 2] / 2
        assert np.abs(found).sum() == pytest.approx(expected)


def test_polygons_of_mixed_sizes_stay_in_order():
    points = np.random.default_rng(0).random((3 + 2 + 4 + 3, 3))
    triangles, faces = triangulate([3, 2, 4, 3], points)
    assert list(faces) == [0, 2, 2, 3]
    assert triangles.min() == 0 and triangles.max() == 11


# Meshes


def test_left_handed_meshes_are_turned_over(tmp_path):
    stage, path = stage_file(tmp_path)
    quad(stage, "/right")
    quad(stage, "/left").CreateOrientationAttr("leftHanded")
    scene, _ = synced(stage, path)
    right, left = (scene.named("meshes", name)[0] for name in ("/right", "/left"))
    assert (normals_of(right)[:, 2] > 0).all()
    assert (normals_of(left)[:, 2] < 0).all()


def test_up_axis_and_units(tmp_path):
    stage, path = stage_file(tmp_path, up="Y", metres=0.01)
    mesh = quad(stage, size=100)
    UsdGeom.XformCommonAPI(mesh).SetTranslate((0, 300, 0))
    scene, _ = synced(stage, path)
    matrix = next(iter(scene.instances.values()))["matrix"]
    assert matrix[:, 3] == pytest.approx([0, 0, 3], abs=1e-6)
    assert matrix @ [100, 100, 0, 1] == pytest.approx([1, 0, 4], abs=1e-6)


def test_holes_and_bad_indices_leave_faces_out(tmp_path):
    stage, path = stage_file(tmp_path)
    mesh = UsdGeom.Mesh.Define(stage, "/grid")
    mesh.CreatePointsAttr([(x, y, 0) for y in range(2) for x in range(4)])
    mesh.CreateFaceVertexCountsAttr([4, 4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 99, 6])
    mesh.CreateHoleIndicesAttr([0])
    mesh.CreateSubdivisionSchemeAttr("none")
    uv = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    uv.Set([(i, 0) for i in range(12)])
    scene, sync = synced(stage, path)
    (found,) = scene.meshes.values()
    assert area(found) == pytest.approx(1)
    assert any("/grid" in text and "99" in text for text in sync.report.warnings)
    _, domain, values = found["attributes"]["st"]
    assert domain == "corner" and len(values) == 12


@pytest.mark.parametrize(
    "name, values, indices, domain, expected",
    [
        ("constant", [(0.5, 0.25)], None, "face", [(0.5, 0.25)] * 2),
        ("uniform", [(3, 4)], None, "face", [(3, 4)] * 2),
        ("vertex", [(0, 0), (1, 0), (1, 1), (0, 1)], None, "vertex", [(0, 0), (1, 0), (1, 1), (0, 1)]),
        ("vertex", [(0, 0), (1, 1)], [0, 0, 1, 1], "vertex", [(0, 0), (0, 0), (1, 1), (1, 1)]),
        ("faceVarying", [(7, 7), (8, 8)], [1, 0, 0, 1], "corner", [(8, 8), (7, 7), (7, 7), (8, 8)]),
    ],
)
def test_primvar_interpolations(tmp_path, name, values, indices, domain, expected):
    stage, path = stage_file(tmp_path)
    primvar = UsdGeom.PrimvarsAPI(quad(stage)).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, name)
    primvar.Set(values)
    if indices:
        primvar.SetIndices(Vt.IntArray(indices))
    scene, _ = synced(stage, path)
    (mesh,) = scene.meshes.values()
    _, found_domain, array = mesh["attributes"]["st"]
    assert found_domain == domain
    assert array.tolist() == [list(map(float, row)) for row in expected]
    assert mesh["default_uv"] == 0


def test_indexed_primvar_with_bad_indices_is_left_out(tmp_path):
    stage, path = stage_file(tmp_path)
    primvar = UsdGeom.PrimvarsAPI(quad(stage)).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
    primvar.Set([(0, 0), (1, 1)])
    primvar.SetIndices(Vt.IntArray([0, 5, 1, 1]))
    scene, sync = synced(stage, path)
    (mesh,) = scene.meshes.values()
    assert "st" not in mesh["attributes"]
    assert any("/quad" in text and "st" in text for text in sync.report.warnings)


def test_normals_per_corner_are_unit_and_zero_ones_are_replaced(tmp_path):
    stage, path = stage_file(tmp_path)
    mesh = quad(stage)
    mesh.CreateNormalsAttr([(0, 0, 2), (0, 3, 0), (0, 0, 0), (1, 0, 0)])
    mesh.SetNormalsInterpolation("faceVarying")
    scene, _ = synced(stage, path)
    normals = next(iter(scene.meshes.values()))["normals"]
    assert normals.tolist() == [[0, 0, 1], [0, 1, 0], [0, 0, 1], [1, 0, 0]]


def test_polygons_without_normals_are_flat_and_subdivision_surfaces_smooth(tmp_path):
    stage, path = stage_file(tmp_path)
    quad(stage, "/flat")
    quad(stage, "/smooth").CreateSubdivisionSchemeAttr("catmullClark")
    scene, sync = synced(stage, path)
    assert scene.named("meshes", "/flat")[0]["normals"] is None
    assert scene.named("meshes", "/smooth")[0]["normals"][0].tolist() == [0, 0, 1]
    assert sum("subdivision" in text for text in sync.report.warnings) == 1


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda m: m.GetPointsAttr().Set([]), "no points"),
        (lambda m: m.GetPointsAttr().Set([(0, 0, 0), (math.nan, 0, 0), (1, 1, 0), (0, 1, 0)]), "not finite"),
        (lambda m: m.GetFaceVertexCountsAttr().Set([]), "no faces"),
        (lambda m: m.GetFaceVertexCountsAttr().Set([5]), "indices"),
        (lambda m: m.GetFaceVertexCountsAttr().Set([-4, 8]), "indices"),
        (lambda m: m.GetFaceVertexIndicesAttr().Set([0, 1, 2, -3]), "faces"),
        (lambda m: m.AddTransformOp().Set(Gf.Matrix4d(math.nan)), "finite"),
    ],
)
def test_a_broken_mesh_is_named_and_the_rest_is_kept(tmp_path, change, words):
    stage, path = stage_file(tmp_path)
    quad(stage, "/good")
    change(quad(stage, "/broken"))
    scene, sync = synced(stage, path)
    assert [i["name"] for i in scene.instances.values()] == ["/good"]
    assert any("/broken" in text and words in text for text in sync.report.warnings), sync.report.warnings


def test_visibility_and_purpose(tmp_path):
    stage, path = stage_file(tmp_path)
    quad(stage, "/seen")
    group = UsdGeom.Xform.Define(stage, "/group")
    group.CreateVisibilityAttr("invisible")
    quad(stage, "/group/hidden")
    quad(stage, "/guide").CreatePurposeAttr("guide")
    quad(stage, "/proxy").CreatePurposeAttr("proxy")
    quad(stage, "/render").CreatePurposeAttr("render")
    scene, _ = synced(stage, path)
    assert sorted(i["name"] for i in scene.instances.values()) == ["/render", "/seen"]


def test_implicit_shapes_have_their_areas(tmp_path):
    stage, path = stage_file(tmp_path)
    UsdGeom.Sphere.Define(stage, "/sphere").CreateRadiusAttr(2)
    UsdGeom.Cube.Define(stage, "/cube").CreateSizeAttr(3)
    cylinder = UsdGeom.Cylinder.Define(stage, "/cylinder")
    cylinder.CreateRadiusAttr(1)
    cylinder.CreateHeightAttr(2)
    cylinder.CreateAxisAttr("X")
    cone = UsdGeom.Cone.Define(stage, "/cone")
    cone.CreateRadiusAttr(1)
    cone.CreateHeightAttr(2)
    scene, _ = synced(stage, path)
    for name, expected in (
        ("/sphere", 16 * math.pi),
        ("/cube", 54),
        ("/cylinder", 6 * math.pi),
        ("/cone", math.pi * (1 + math.sqrt(5))),
    ):
        mesh = scene.named("meshes", name)[0]
        assert area(mesh) == pytest.approx(expected, rel=2e-3), name
        corners = mesh["positions"][mesh["tri_vertices"]].mean(axis=1)
        assert (np.einsum("ij,ij->i", normals_of(mesh), corners) > 0).all(), f"{name} faces outwards"
    cylinder = scene.named("meshes", "/cylinder")[0]
    assert np.ptp(cylinder["positions"], axis=0) == pytest.approx([2, 2, 2], rel=1e-3)
    ends = cylinder["normals"][np.isclose(np.abs(cylinder["positions"][:, 0]), 1)]
    assert np.isclose(np.abs(ends[:, 0]), 1).any(), "the axis is x"


# Instances


def test_native_instances_share_one_mesh(tmp_path):
    stage, path = stage_file(tmp_path)
    quad(stage, "/library/thing")
    stage.GetPrimAtPath("/library").SetSpecifier(Sdf.SpecifierOver)
    for number in range(3):
        prim = stage.DefinePrim(f"/copy{number}", "Xform")
        prim.GetReferences().AddInternalReference("/library")
        prim.SetInstanceable(True)
        UsdGeom.XformCommonAPI(prim).SetTranslate((number, 0, 0))
    scene, _ = synced(stage, path)
    assert len(scene.meshes) == 1
    assert sorted(float(i["matrix"][0, 3]) for i in scene.instances.values()) == [0, 1, 2]


def instancer(stage, path="/many", prototypes=("proto",)):
    result = UsdGeom.PointInstancer.Define(stage, path)
    for name in prototypes:
        quad(stage, f"{path}/{name}")
        result.CreatePrototypesRel().AddTarget(f"{path}/{name}")
    return result


def test_point_instancer_orientations_scales_and_prototypes_own_transform(tmp_path):
    stage, path = stage_file(tmp_path)
    many = instancer(stage)
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/many/proto")).SetTranslate((0, 0, 5))
    UsdGeom.XformCommonAPI(many).SetTranslate((100, 0, 0))
    many.CreateProtoIndicesAttr([0, 0])
    many.CreatePositionsAttr([(1, 0, 0), (2, 0, 0)])
    half = math.sqrt(0.5)
    many.CreateOrientationsAttr([Gf.Quath(1, 0, 0, 0), Gf.Quath(half, 0, 0, half)])  # a quarter turn about z
    many.CreateScalesAttr([(1, 1, 1), (2, 2, 2)])
    scene, _ = synced(stage, path)
    matrices = sorted((i["matrix"] for i in scene.instances.values()), key=lambda m: m[0, 3])
    assert matrices[0] @ [1, 0, 0, 1] == pytest.approx([102, 0, 5], abs=1e-2)
    assert matrices[1] @ [1, 0, 0, 1] == pytest.approx([102, 2, 10], abs=1e-2)
    assert len(scene.meshes) == 1, "the prototype is not drawn itself"


def test_point_instancer_invisible_and_bad_copies(tmp_path):
    stage, path = stage_file(tmp_path)
    many = instancer(stage, prototypes=("a", "b"))
    many.CreateProtoIndicesAttr([0, 1, 7, 0, 1])
    many.CreatePositionsAttr([(x, 0, 0) for x in range(4)] + [(math.inf, 0, 0)])
    many.CreateIdsAttr([10, 11, 12, 13, 14])
    many.CreateInvisibleIdsAttr([13])
    scene, sync = synced(stage, path)
    assert sorted(float(i["matrix"][0, 3]) for i in scene.instances.values()) == [0, 1]
    assert any("/many" in text and "2 of 5" in text for text in sync.report.warnings)


def test_nested_instancers_multiply(tmp_path):
    stage, path = stage_file(tmp_path)
    outer = UsdGeom.PointInstancer.Define(stage, "/outer")
    inner = instancer(stage, "/outer/inner")
    outer.CreatePrototypesRel().AddTarget("/outer/inner")
    inner.CreateProtoIndicesAttr([0, 0])
    inner.CreatePositionsAttr([(1, 0, 0), (2, 0, 0)])
    outer.CreateProtoIndicesAttr([0, 0, 0])
    outer.CreatePositionsAttr([(0, 10, 0), (0, 20, 0), (0, 30, 0)])
    scene, _ = synced(stage, path)
    places = sorted((float(i["matrix"][1, 3]), float(i["matrix"][0, 3])) for i in scene.instances.values())
    assert places == [(y, x) for y in (10, 20, 30) for x in (1, 2)]


def test_an_instancer_of_itself_is_refused(tmp_path):
    stage, path = stage_file(tmp_path)
    loop = UsdGeom.PointInstancer.Define(stage, "/loop")
    loop.CreatePrototypesRel().AddTarget("/loop")
    loop.CreateProtoIndicesAttr([0])
    loop.CreatePositionsAttr([(0, 0, 0)])
    scene, sync = synced(stage, path)
    assert not scene.instances
    assert any("/loop" in text for text in sync.report.warnings)


# Time


def test_only_what_changed_is_sent_again(tmp_path):
    stage, path = stage_file(tmp_path)
    quad(stage, "/still")
    moving = quad(stage, "/moving")
    spin = moving.AddTranslateOp()
    spin.Set((0, 0, 0), 1)
    spin.Set((10, 0, 0), 11)
    soft = quad(stage, "/soft")
    soft.GetPointsAttr().Set([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], 1)
    soft.GetPointsAttr().Set([(0, 0, 0), (3, 0, 0), (3, 1, 0), (0, 1, 0)], 11)
    scene, sync = synced(stage, path, 1)
    scene.log = []
    synced(stage, path, 6, sync=sync)
    assert sorted(kind for kind, _ in scene.log if kind != "camera") == ["instance", "mesh"]
    assert scene.named("instances", "/moving")[0]["matrix"][0, 3] == pytest.approx(5)
    assert area(scene.named("meshes", "/soft")[0]) == pytest.approx(2)


def test_what_disappears_is_removed(tmp_path):
    stage, path = stage_file(tmp_path)
    visibility = quad(stage, "/blinks").CreateVisibilityAttr()
    visibility.Set("inherited", 1)
    visibility.Set("invisible", 2)
    scene, sync = synced(stage, path, 1)
    assert scene.instances
    synced(stage, path, 2, sync=sync)
    assert not scene.instances


def test_a_changing_number_of_copies(tmp_path):
    stage, path = stage_file(tmp_path)
    many = instancer(stage)
    for time, count in ((1, 3), (2, 5), (3, 1), (4, 0)):
        many.CreateProtoIndicesAttr().Set([0] * count, time)
        many.CreatePositionsAttr().Set([(x, 0, 0) for x in range(count)], time)
    scene, sync = synced(stage, path, 1)
    for time, count in ((1, 3), (2, 5), (3, 1), (4, 0)):
        synced(stage, path, time, sync=sync)
        assert len(scene.instances) == count


# Skinning


def skeleton(stage, root="/char"):
    """A strip of two joints along x; at time 10 the second joint is turned a quarter about z."""
    UsdSkel.Root.Define(stage, root)
    skel = UsdSkel.Skeleton.Define(stage, f"{root}/skel")
    skel.CreateJointsAttr(["a", "a/b"])
    bind = [Gf.Matrix4d(1), Gf.Matrix4d(1).SetTranslate((1, 0, 0))]
    skel.CreateBindTransformsAttr(bind)
    skel.CreateRestTransformsAttr(bind)
    animation = UsdSkel.Animation.Define(stage, f"{root}/anim")
    animation.CreateJointsAttr(["a", "a/b"])
    animation.CreateTranslationsAttr([(0, 0, 0), (1, 0, 0)])
    animation.CreateScalesAttr([(1, 1, 1), (1, 1, 1)])
    turned = Gf.Quatf(math.sqrt(0.5), 0, 0, math.sqrt(0.5))
    animation.CreateRotationsAttr().Set([Gf.Quatf(1), Gf.Quatf(1)], 1)
    animation.CreateRotationsAttr().Set([Gf.Quatf(1), turned], 10)
    UsdSkel.BindingAPI.Apply(skel.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    return skel


def skinned_strip(stage, skel, path="/char/strip"):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    mesh.CreateSubdivisionSchemeAttr("none")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skel.GetPath()])
    binding.CreateJointIndicesPrimvar(False, 1).Set([0, 1, 1, 0])
    binding.CreateJointWeightsPrimvar(False, 1).Set([1.0, 1.0, 1.0, 1.0])
    return mesh


def placed_points(scene, name):
    (instance,) = scene.named("instances", name)
    points = scene.named("meshes", name)[0]["positions"]
    return points @ instance["matrix"][:, :3].T + instance["matrix"][:, 3]


def test_skinned_points_follow_the_skeleton(tmp_path):
    stage, path = stage_file(tmp_path)
    skel = skeleton(stage)
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/char")).SetTranslate((0, 0, 7))
    skinned_strip(stage, skel)
    scene, sync = synced(stage, path, 1)
    assert placed_points(scene, "/char/strip")[1] == pytest.approx([2, 0, 7], abs=1e-5)
    synced(stage, path, 10, sync=sync)
    points = placed_points(scene, "/char/strip")
    assert points[1] == pytest.approx([1, 1, 7], abs=1e-5)
    assert points[2] == pytest.approx([0, 1, 7], abs=1e-5)
    assert points[0] == pytest.approx([0, 0, 7], abs=1e-5)


def test_rigid_binding_moves_the_whole_mesh(tmp_path):
    stage, path = stage_file(tmp_path)
    skel = skeleton(stage)
    binding = UsdSkel.BindingAPI(skinned_strip(stage, skel))
    binding.CreateJointIndicesPrimvar(True, 1).Set([1])
    binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    scene, sync = synced(stage, path, 10)
    assert placed_points(scene, "/char/strip")[1] == pytest.approx([1, 1, 0], abs=1e-5)


def test_blend_shapes(tmp_path):
    stage, path = stage_file(tmp_path)
    skel = skeleton(stage)
    mesh = skinned_strip(stage, skel)
    shape = UsdSkel.BlendShape.Define(stage, "/char/strip/up")
    shape.CreateOffsetsAttr([(0, 0, 2)])
    shape.CreatePointIndicesAttr([3])
    binding = UsdSkel.BindingAPI(mesh)
    binding.CreateBlendShapesAttr(["up"])
    binding.CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/char/anim"))
    animation.CreateBlendShapesAttr(["up"])
    animation.CreateBlendShapeWeightsAttr([0.25])
    scene, sync = synced(stage, path, 1)
    assert not sync.report.warnings[1:], sync.report.warnings
    assert placed_points(scene, "/char/strip")[3] == pytest.approx([0, 1, 0.5], abs=1e-5)


def test_broken_joint_indices_are_named(tmp_path):
    stage, path = stage_file(tmp_path)
    binding = UsdSkel.BindingAPI(skinned_strip(stage, skeleton(stage)))
    binding.CreateJointIndicesPrimvar(False, 1).Set([0, 55, 1, 0])
    scene, sync = synced(stage, path, 1)
    assert any("/char/strip" in text for text in sync.report.warnings) or placed_points(scene, "/char/strip").any()


# Camera


def test_camera_plane_depth_of_field_and_units(tmp_path):
    stage, path = stage_file(tmp_path, metres=0.01)  # a stage in centimetres
    camera = UsdGeom.Camera.Define(stage, "/cam")
    camera.CreateFocalLengthAttr(50)  # tenths of a centimetre: 50 mm
    camera.CreateHorizontalApertureAttr(36)
    camera.CreateVerticalApertureAttr(24)
    camera.CreateHorizontalApertureOffsetAttr(3.6)
    camera.CreateFStopAttr(2.0)
    camera.CreateFocusDistanceAttr(250)
    camera.CreateClippingRangeAttr((10, 5000))
    UsdGeom.XformCommonAPI(camera).SetTranslate((100, 200, 300))
    scene, _ = synced(stage, path, aspect=1.5)
    found = scene.camera
    assert found["kind"] == "perspective"
    assert found["plane"] == pytest.approx((-0.36 + 0.072, 0.36 + 0.072, -0.24, 0.24))
    assert found["clip"] == pytest.approx((0.1, 50))
    assert found["aperture_radius"] == pytest.approx(0.05 / 4)
    assert found["focus_distance"] == pytest.approx(2.5)
    assert found["matrix"][:, 3] == pytest.approx([1, 2, 3])
    assert np.linalg.norm(found["matrix"][:, :3], axis=0) == pytest.approx([1, 1, 1])


@pytest.mark.parametrize("aspect, expected", [(3.0, (0.72, 0.24)), (1.0, (0.36, 0.36))])
def test_the_picture_shows_all_of_the_aperture(tmp_path, aspect, expected):
    stage, path = stage_file(tmp_path)
    camera = UsdGeom.Camera.Define(stage, "/cam")
    camera.CreateFocalLengthAttr(50)
    camera.CreateHorizontalApertureAttr(36)
    camera.CreateVerticalApertureAttr(24)
    scene, _ = synced(stage, path, aspect=aspect)
    assert scene.camera["plane"][1::2] == pytest.approx(expected)


def test_orthographic_camera(tmp_path):
    stage, path = stage_file(tmp_path, metres=0.5)
    camera = UsdGeom.Camera.Define(stage, "/cam")
    camera.CreateProjectionAttr("orthographic")
    camera.CreateHorizontalApertureAttr(40)  # 4 units, 2 m
    camera.CreateVerticalApertureAttr(20)
    scene, _ = synced(stage, path, aspect=2.0)
    assert scene.camera["kind"] == "orthographic"
    assert scene.camera["plane"] == pytest.approx((-1, 1, -0.5, 0.5))


def test_choice_of_camera(tmp_path):
    stage, path = stage_file(tmp_path)
    for name, x in (("/rig/first", 1), ("/rig/second", 2)):
        UsdGeom.XformCommonAPI(UsdGeom.Camera.Define(stage, name)).SetTranslate((x, 0, 0))
    for name, x in ((None, 1), ("second", 2), ("/rig/second", 2)):
        scene, _ = synced(stage, path, camera=name)
        assert scene.camera["matrix"][0, 3] == x
    with pytest.raises(UserError, match="/rig/first"):
        synced(stage, path, camera="third")


def test_without_a_camera_everything_is_seen(tmp_path):
    stage, path = stage_file(tmp_path, up="Y")
    UsdGeom.XformCommonAPI(quad(stage, size=4)).SetTranslate((50, 0, -20))
    scene, sync = synced(stage, path, aspect=2.0)
    matrix, plane = scene.camera["matrix"], scene.camera["plane"]
    for corner in placed_points(scene, "/quad"):
        local = matrix[:, :3].T @ (corner - matrix[:, 3])
        assert plane[0] < local[0] / -local[2] < plane[1] and plane[2] < local[1] / -local[2] < plane[3]
        assert scene.camera["clip"][0] < -local[2] < scene.camera["clip"][1]
    assert any("camera" in text for text in sync.report.warnings)


def test_flat_camera_is_an_error(tmp_path):
    stage, path = stage_file(tmp_path)
    camera = UsdGeom.Camera.Define(stage, "/cam")
    camera.AddScaleOp().Set((1, 0, 0))
    with pytest.raises(UserError, match="/cam"):
        synced(stage, path)

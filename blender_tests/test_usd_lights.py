# SPDX-License-Identifier: Apache-2.0
"""UsdLux lights, domes, materials and textures as scene edits, against a recording double of the core."""

import math

import fake_core
import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from headwater.image_io import write_exr, write_png8
from headwater.usd_scene import StageSync, light, open_stage


def stage_file(tmp_path, up="Z", metres=1.0):
    path = str(tmp_path / "scene.usda")
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.Camera.Define(stage, "/camera")
    return stage, path


def synced(stage, path, frame=1.0):
    stage.GetRootLayer().Save()
    scene = fake_core.Scene()
    sync = StageSync(open_stage(path), scene, flags=fake_core.flags)
    sync.sync(frame, aspect=1.0)
    return scene, sync


def radiance_of(lamp):
    """Radiance that the core gives a recorded lamp: core/lights/lamp.cpp's conventions, written out again."""
    value = np.array(lamp["color"]) * lamp["power"]
    assert lamp["normalize"]
    if lamp["kind"] in ("point", "spot"):
        return value / (4 * math.pi**2 * lamp["radius"] ** 2)
    if lamp["kind"] == "area":
        area = lamp["size_x"] * lamp["size_y"] * (math.pi / 4 if lamp["ellipse"] else 1)
        return value / (math.pi * area)
    half = lamp["angle"] / 2
    return value / (math.pi * math.sin(half) ** 2)


def only(scene):
    (lamp,) = scene.lights.values()
    return lamp


def test_radiance_is_intensity_exposure_and_colour(tmp_path):
    stage, path = stage_file(tmp_path)
    rect = UsdLux.RectLight.Define(stage, "/light")
    rect.CreateWidthAttr(2)
    rect.CreateHeightAttr(3)
    rect.CreateIntensityAttr(5)
    rect.CreateExposureAttr(2)
    rect.CreateColorAttr((1, 0.5, 0.25))
    lamp = only(synced(stage, path)[0])
    assert lamp["kind"] == "area" and not lamp["ellipse"]
    assert (lamp["size_x"], lamp["size_y"]) == (2, 3)
    assert radiance_of(lamp) == pytest.approx([20, 10, 5])
    assert lamp["flags"] & fake_core.flags["HW_LIGHT_CAMERA"]


def test_normalize_divides_by_the_area_in_stage_units(tmp_path):
    for metres in (1.0, 0.01):
        folder = tmp_path / str(metres)
        folder.mkdir()
        stage, path = stage_file(folder, metres=metres)
        rect = UsdLux.RectLight.Define(stage, "/light")
        rect.CreateWidthAttr(4)
        rect.CreateHeightAttr(5)
        rect.CreateNormalizeAttr(True)
        rect.CreateIntensityAttr(60)
        rect.AddScaleOp().Set((3, 1, 1))
        lamp = only(synced(stage, path)[0])
        assert radiance_of(lamp) == pytest.approx([1, 1, 1])
        assert lamp["size_x"] == pytest.approx(12 * metres)


def test_sphere_disk_and_distant_lights(tmp_path):
    stage, path = stage_file(tmp_path)
    UsdLux.SphereLight.Define(stage, "/sphere").CreateRadiusAttr(0.25)
    UsdLux.DiskLight.Define(stage, "/disk").CreateRadiusAttr(2)
    distant = UsdLux.DistantLight.Define(stage, "/sun")
    distant.CreateAngleAttr(10)
    distant.CreateIntensityAttr(7)
    sphere, disk, sun = (synced(stage, path)[0].named("lights", name)[0] for name in ("/sphere", "/disk", "/sun"))
    assert radiance_of(sphere) == pytest.approx([1, 1, 1])
    assert sphere["kind"] == "point" and sphere["radius"] == 0.25
    assert disk["ellipse"] and disk["size_x"] == 4
    assert radiance_of(disk) == pytest.approx([1, 1, 1])
    assert sun["kind"] == "sun" and sun["angle"] == pytest.approx(math.radians(10))
    assert radiance_of(sun) == pytest.approx([7, 7, 7])


def test_normalized_distant_light_gives_its_intensity_as_irradiance(tmp_path):
    stage, path = stage_file(tmp_path, metres=0.01)
    for name, angle in (("/wide", 30), ("/narrow", 0)):
        distant = UsdLux.DistantLight.Define(stage, name)
        distant.CreateAngleAttr(angle)
        distant.CreateIntensityAttr(3)
        distant.CreateNormalizeAttr(True)
    scene, _ = synced(stage, path)
    assert all(lamp["power"] == pytest.approx(3) for lamp in scene.lights.values())


def test_treat_as_point_keeps_the_intensity(tmp_path):
    stage, path = stage_file(tmp_path)
    sphere = UsdLux.SphereLight.Define(stage, "/light")
    sphere.CreateRadiusAttr(0.1)
    sphere.CreateIntensityAttr(9)
    sphere.CreateTreatAsPointAttr(True)
    lamp = only(synced(stage, path)[0])
    assert lamp["radius"] == 0
    # A point lamp of P watts has the intensity P / 4 π; a small sphere has its radiance times π r².
    assert lamp["power"] / (4 * math.pi) == pytest.approx(9 * math.pi * 0.01)


def test_sphere_without_a_radius(tmp_path):
    stage, path = stage_file(tmp_path)
    for name, normalize in (("/dark", False), ("/lit", True)):
        sphere = UsdLux.SphereLight.Define(stage, name)
        sphere.CreateRadiusAttr(0)
        sphere.CreateNormalizeAttr(normalize)
        sphere.CreateIntensityAttr(8)
    scene, sync = synced(stage, path)
    assert only(scene)["name"] == "/lit"
    assert only(scene)["power"] / (4 * math.pi) == pytest.approx(2)
    assert any("/dark" in text for text in sync.report.warnings)


def test_shaping_cone_makes_a_spot(tmp_path):
    stage, path = stage_file(tmp_path)
    sphere = UsdLux.SphereLight.Define(stage, "/light")
    shaping = UsdLux.ShapingAPI.Apply(sphere.GetPrim())
    shaping.CreateShapingConeAngleAttr(30)
    shaping.CreateShapingConeSoftnessAttr(0.5)
    lamp = only(synced(stage, path)[0])
    assert lamp["kind"] == "spot"
    assert lamp["spot_size"] == pytest.approx(math.radians(60))
    assert lamp["spot_blend"] == 0.5


def test_colour_temperature(tmp_path):
    stage, path = stage_file(tmp_path)
    sphere = UsdLux.SphereLight.Define(stage, "/light")
    sphere.CreateEnableColorTemperatureAttr(True)
    sphere.CreateColorTemperatureAttr(3000)
    color = only(synced(stage, path)[0])["color"]
    assert color[0] > color[1] > color[2]


def test_lights_point_along_minus_z_of_their_prim(tmp_path):
    stage, path = stage_file(tmp_path, up="Y", metres=0.1)
    rect = UsdLux.RectLight.Define(stage, "/light")
    rect.AddTranslateOp().Set((0, 50, 0))
    rect.AddRotateXOp().Set(-90)  # shines down, -y
    lamp = only(synced(stage, path)[0])
    matrix = lamp["matrix"]
    assert matrix[:, 3] == pytest.approx([0, 0, 5])
    assert -matrix[:, 2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert np.linalg.norm(matrix[:, :3], axis=0) == pytest.approx([1, 1, 1])
    assert lamp["size_x"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    "break_it",
    [
        lambda prim: UsdLux.LightAPI(prim).CreateIntensityAttr(math.nan),
        lambda prim: UsdLux.RectLight(prim).CreateWidthAttr(-1),
        lambda prim: UsdLux.RectLight(prim).CreateWidthAttr(0),
        lambda prim: UsdGeom.Xformable(prim).AddScaleOp().Set((0, 0, 0)),
        lambda prim: UsdGeom.Xformable(prim).AddTranslateOp().Set((math.nan, 0, 0)),
    ],
)
def test_broken_lights_are_named_and_left_out(tmp_path, break_it):
    stage, path = stage_file(tmp_path)
    break_it(UsdLux.RectLight.Define(stage, "/broken").GetPrim())
    scene, sync = synced(stage, path)
    assert not scene.lights
    assert any("/broken" in text for text in sync.report.warnings)


def test_cylinder_light_is_an_emissive_tube(tmp_path):
    stage, path = stage_file(tmp_path)
    tube = UsdLux.CylinderLight.Define(stage, "/tube")
    tube.CreateRadiusAttr(0.5)
    tube.CreateLengthAttr(3)
    tube.CreateIntensityAttr(6 * math.pi)
    tube.CreateNormalizeAttr(True)
    tube.AddScaleOp().Set((2, 1, 1))
    scene, _ = synced(stage, path)
    (mesh,) = scene.meshes.values()
    corners = mesh["positions"][mesh["tri_vertices"]].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(3 * math.pi, rel=1e-3)
    outwards = corners.mean(axis=1) * [0, 1, 1]
    assert (np.einsum("ij,ij->i", normals, outwards) > 0).all()
    (material,) = scene.materials.values()
    assert material["emission"] == pytest.approx((1, 1, 1)), "6 π over the area 6 π"
    assert material["flags"] & fake_core.flags["HW_MATERIAL_EMISSIVE"]


# Domes


def look_up(direction, rotation):
    """Texture coordinates of Blender's equirectangular look-up for a world direction."""
    x, y, z = rotation @ np.asarray(direction, float)
    return (-math.atan2(y, x) / (2 * math.pi) + 0.5) % 1.0, math.atan2(z, math.hypot(x, y)) / math.pi + 0.5


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_dome_orientation(tmp_path, up):
    """UsdLux's latlong: the centre is at +z of the dome's space, +x a quarter to its left, +y above."""
    stage, path = stage_file(tmp_path, up=up)
    dome = UsdLux.DomeLight.Define(stage, "/dome")
    stage.GetRootLayer().Save()
    to_world = open_stage(path).to_world
    rotation = light.dome_rotation(dome.GetPrim(), to_world)
    for local, expected in (((0, 0, 1), (0.5, 0.5)), ((1, 0, 0), (0.25, 0.5)), ((-1, 0, 0), (0.75, 0.5))):
        assert look_up(to_world[:3, :3] @ local, rotation) == pytest.approx(expected)
    assert look_up(to_world[:3, :3] @ (0, 1, 0), rotation)[1] == pytest.approx(1)


def test_dome_with_its_pole_on_the_stage_axis(tmp_path):
    stage, _ = stage_file(tmp_path, up="Z")
    dome = UsdLux.DomeLight_1.Define(stage, "/dome")
    rotation = light.dome_rotation(dome.GetPrim(), np.eye(4))
    assert look_up((0, 0, 1), rotation)[1] == pytest.approx(1)
    assert look_up((0, -1, 0), rotation) == pytest.approx((0.5, 0.5))
    assert look_up((1, 0, 0), rotation) == pytest.approx((0.25, 0.5))


def test_domes_without_textures_add_up(tmp_path):
    stage, path = stage_file(tmp_path)
    for name, color in (("/a", (1, 0, 0)), ("/b", (0, 2, 0))):
        UsdLux.DomeLight.Define(stage, name).CreateColorAttr(color)
    scene, _ = synced(stage, path)
    assert scene.world["color"] == (1, 2, 0)
    assert scene.world["material"] == 0


def test_dome_texture_becomes_a_background_program(tmp_path):
    stage, path = stage_file(tmp_path)
    write_exr(str(tmp_path / "sky.exr"), {"Combined": np.ones((4, 8, 4), np.float32)})
    UsdLux.DomeLight.Define(stage, "/dome").CreateTextureFileAttr("./sky.exr")
    scene, _ = synced(stage, path)
    (image,) = scene.images.values()
    assert image["shape"] == (4, 8, 4) and not image["srgb"]
    assert scene.world["material"] in scene.materials


def test_missing_dome_texture_is_told(tmp_path):
    stage, path = stage_file(tmp_path)
    UsdLux.DomeLight.Define(stage, "/dome").CreateTextureFileAttr("./nothing.exr")
    scene, sync = synced(stage, path)
    (image,) = scene.images.values()
    assert image["shape"] is None
    assert any("/dome" in text for text in sync.report.warnings)


# Materials


def surface(stage, path, **inputs):
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path + "/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for name, (kind, value) in inputs.items():
        shader.CreateInput(name, kind).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material, shader


def quads(stage, path="/mesh", count=1):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(x + dx, y, 0) for x in range(count) for dx, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
    mesh.CreateFaceVertexCountsAttr([4] * count)
    mesh.CreateFaceVertexIndicesAttr(list(range(4 * count)))
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def bind(prim, material):
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)


@pytest.fixture
def preview_surface():
    return pytest.importorskip("headwater.materials.preview_surface")


def test_material_subsets_become_slots(tmp_path, preview_surface):
    stage, path = stage_file(tmp_path)
    mesh = quads(stage, count=3)
    red, _ = surface(stage, "/red", diffuseColor=(Sdf.ValueTypeNames.Color3f, (1, 0, 0)))
    blue, _ = surface(stage, "/blue", diffuseColor=(Sdf.ValueTypeNames.Color3f, (0, 0, 1)))
    bind(mesh, red)
    subset = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).CreateMaterialBindSubset("part", [1, 77])
    bind(subset, blue)
    scene, sync = synced(stage, path)
    (instance,) = scene.instances.values()
    assert [scene.materials[m]["name"] for m in instance["materials"]] == ["/red", "/blue"]
    (found,) = scene.meshes.values()
    assert found["tri_slots"].tolist() == [0, 0, 1, 1, 0, 0]
    assert any("/mesh" in text and "subset" in text for text in sync.report.warnings)


def test_inherited_and_shared_materials_are_compiled_once(tmp_path, preview_surface):
    stage, path = stage_file(tmp_path)
    group = UsdGeom.Xform.Define(stage, "/group")
    material, _ = surface(stage, "/material")
    bind(group, material)
    quads(stage, "/group/a")
    quads(stage, "/group/b")
    scene, _ = synced(stage, path)
    assert len(scene.materials) == 1
    assert len({i["materials"][0] for i in scene.instances.values()}) == 1


def test_unbound_meshes_use_their_display_colour(tmp_path):
    stage, path = stage_file(tmp_path)
    quads(stage, "/plain")
    quads(stage, "/coloured").CreateDisplayColorAttr([(1, 0, 0)])
    scene, _ = synced(stage, path)
    assert scene.named("instances", "/plain")[0]["materials"] == [0]
    (used,) = scene.named("instances", "/coloured")[0]["materials"]
    assert scene.materials[used]["name"] == "displayColor"


def textured(stage, file, color_space=None):
    material, shader = surface(stage, "/material")
    texture = UsdShade.Shader.Define(stage, "/material/texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    if color_space:
        texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(color_space)
    reader = UsdShade.Shader.Define(stage, "/material/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(texture.ConnectableAPI(), "rgb")
    bind(quads(stage), material)


def bent(stage, path, varname, transformed=False):
    """A material with a normal map placed by a primvar, perhaps through a transform; "": by none."""
    material, shader = surface(stage, path)
    texture = UsdShade.Shader.Define(stage, path + "/texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("bumps.png")
    where = texture.CreateInput("st", Sdf.ValueTypeNames.Float2)
    if transformed:
        turn = UsdShade.Shader.Define(stage, path + "/transform")
        turn.CreateIdAttr("UsdTransform2d")
        where.ConnectToSource(turn.ConnectableAPI(), "result")
        where = turn.CreateInput("in", Sdf.ValueTypeNames.Float2)
    if varname:
        reader = UsdShade.Shader.Define(stage, path + "/reader")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(varname)
        where.ConnectToSource(reader.ConnectableAPI(), "result")
    shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(texture.ConnectableAPI(), "rgb")
    return material


def mapped(mesh, **interpolations):
    """Gives a mesh UV maps by name: their interpolation."""
    vertices, faces = len(mesh.GetPointsAttr().Get()), len(mesh.GetFaceVertexCountsAttr().Get())
    counts = {"vertex": vertices, "faceVarying": 4 * faces, "uniform": faces}
    for name, kind in interpolations.items():
        primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, Sdf.ValueTypeNames.TexCoord2fArray, kind)
        primvar.Set([(i % 4, i // 4) for i in range(counts[kind])])
    return mesh


@pytest.mark.parametrize(
    "varname, transformed, name, used",
    [("st", False, "st.tangent", 0), ("other", True, "other.tangent", 1), ("", False, ".tangent", 0),
     ("even", False, None, None), ("none", False, None, None)],
)  # fmt: skip
def test_normal_maps_get_the_tangents_of_their_uv_map(tmp_path, preview_surface, varname, transformed, name, used):
    stage, path = stage_file(tmp_path)
    mesh = mapped(quads(stage, count=2), st="vertex", other="vertex", even="uniform")
    mesh.CreateNormalsAttr([(0, 0, 1), (0, 1, 0)] * 4)
    mesh.SetNormalsInterpolation("vertex")
    bind(mesh, bent(stage, "/bent", varname, transformed))
    scene, _ = synced(stage, path)
    (sent,) = scene.meshes.values()
    names = list(sent["attributes"])
    assert [(n, names[i]) for n, i in sent["tangents"]] == ([] if name is None else [(name, ("st", "other")[used])])
    if name is not None:  # corners of their own, as a vertex may need several
        assert sent["tri_corners"].reshape(-1).tolist() == list(range(12))
    corners = sent["tri_vertices"] if sent["tri_corners"] is None else sent["tri_corners"]
    assert sent["normals"][corners, 1].tolist() == (sent["tri_vertices"] % 2).tolist()


def test_tangents_that_instances_ask_for_later_are_sent_and_too_many_left_out(tmp_path, preview_surface):
    stage, path = stage_file(tmp_path)
    mapped(quads(stage, "/library/thing"), st="faceVarying")
    stage.GetPrimAtPath("/library").SetSpecifier(Sdf.SpecifierOver)
    plain, _ = surface(stage, "/plain")
    for number, material in enumerate((plain, bent(stage, "/bent", "st"), plain, bent(stage, "/default", ""))):
        prim = stage.DefinePrim(f"/copy{number}", "Xform")
        prim.GetReferences().AddInternalReference("/library")
        prim.SetInstanceable(True)
        bind(UsdGeom.Xform(prim), material)
    full = mapped(quads(stage, "/full"), **{f"m{i}": "faceVarying" for i in range(8)})
    bind(full, bent(stage, "/bent3", "m3"))
    scene, sync = synced(stage, path)
    sent = {mesh["name"]: mesh["tangents"] for mesh in scene.meshes.values()}
    assert sent.pop("/full") == []
    assert [sorted(tangents) for tangents in sent.values()] == [[(".tangent", 0), ("st.tangent", 0)]]
    assert any("/full" in text and "no room for the tangents" in text for text in sync.report.warnings)
    scene.log.clear()
    sync.sync(2.0, aspect=1.0)
    assert not [entry for entry in scene.log if entry[0] == "mesh"]


@pytest.mark.parametrize("space, srgb", [(None, True), ("auto", True), ("sRGB", True), ("raw", False)])
def test_texture_colour_spaces(tmp_path, preview_surface, space, srgb):
    stage, path = stage_file(tmp_path)
    write_png8(str(tmp_path / "wood.png"), np.full((2, 3, 3), 100, np.uint8))
    textured(stage, "./wood.png", space)
    (image,) = synced(stage, path)[0].images.values()
    assert image["shape"] == (2, 3, 3)
    assert image["srgb"] == srgb


@pytest.mark.parametrize("content", [None, b"", b"not a picture", b"\x89PNG\r\n\x1a\n" + b"\0" * 30])
def test_missing_and_broken_textures_are_told(tmp_path, preview_surface, content):
    stage, path = stage_file(tmp_path)
    if content is not None:
        (tmp_path / "wood.png").write_bytes(content)
    textured(stage, "./wood.png")
    scene, sync = synced(stage, path)
    (image,) = scene.images.values()
    assert image["shape"] is None
    assert any("/material" in text for text in sync.report.warnings), sync.report.warnings


def test_textures_inside_packages(tmp_path, preview_surface):
    from pxr import UsdUtils

    stage, path = stage_file(tmp_path)
    write_png8(str(tmp_path / "wood.png"), np.full((5, 3, 3), 100, np.uint8))
    textured(stage, "./wood.png")
    stage.GetRootLayer().Save()
    package = str(tmp_path / "scene.usdz")
    assert UsdUtils.CreateNewUsdzPackage(path, package)
    scene = fake_core.Scene()
    StageSync(open_stage(package), scene, flags=fake_core.flags).sync(1.0, aspect=1.0)
    (image,) = scene.images.values()
    assert image["shape"] == (5, 3, 3)


def test_sun_matrix_is_the_direction_light_comes_from(tmp_path):
    stage, path = stage_file(tmp_path)
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.AddTransformOp().Set(Gf.Matrix4d().SetRotate(Gf.Rotation((1, 0, 0), 90)))  # -z goes to +y
    matrix = only(synced(stage, path)[0])["matrix"]
    assert -matrix[:, 2] == pytest.approx([0, 1, 0], abs=1e-6)


def test_lamps_that_are_alike_are_sent_together(tmp_path):
    stage, path = stage_file(tmp_path)
    for i in range(4):
        light = UsdLux.SphereLight.Define(stage, f"/light{i}")
        light.CreateIntensityAttr(2 if i < 3 else 5)
        move = light.AddTranslateOp()
        move.Set((i, 0, 0), 1)
        move.Set((i, 0, 0 if i else 1), 2)
    stage.GetRootLayer().Save()
    calls = []

    class Counting(fake_core.Scene):
        refused = None

        def upsert_lights(self, ids, name, kind, matrices, **rest):
            calls.append(len(ids))
            if any(matrix[0, 3] == self.refused for matrix in matrices):
                raise ValueError("it is refused")
            super().upsert_lights(ids, name, kind, matrices, **rest)

    scene = Counting()
    warnings = []
    sync = StageSync(open_stage(path), scene, warn=warnings.append, flags=fake_core.flags)
    sync.sync(1.0, aspect=1.0)
    assert sorted(calls) == [1, 3] and len(scene.lights) == 4
    places = {lamp["matrix"][0, 3]: lamp["power"] for lamp in scene.lights.values()}
    assert places[0] == places[1] == places[2] == pytest.approx(places[3] * 2 / 5)
    calls.clear()
    sync.sync(1.0, aspect=1.0)
    assert not calls
    sync.sync(2.0, aspect=1.0)  # one moved
    assert calls == [1]
    assert [lamp["matrix"][2, 3] for lamp in scene.lights.values() if lamp["matrix"][0, 3] == 0] == [1]
    assert not warnings
    # One that is refused does not take the others with it.
    scene = Counting()
    scene.refused = 2
    sync = StageSync(open_stage(path), scene, warn=warnings.append, flags=fake_core.flags)
    sync.sync(1.0, aspect=1.0)
    assert len(scene.lights) == 3 and len(warnings) == 1 and "/light2" in warnings[0]

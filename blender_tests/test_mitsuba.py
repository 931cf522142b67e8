# SPDX-License-Identifier: Apache-2.0
"""Converged `path` against Mitsuba 3 on the same USD geometry and lights: Welch tests of tiles over independent seeds.

Mitsuba's scene is made from the USD file itself by a small converter here, which reads points, display colours, lights
and camera with its own formulas (not the package's). Materials are Lambertian, which both renderers define alike; box
pixel filters and equal path lengths make the two expectations equal, so the test needs no tolerance but noise.
"""

import math

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux

from headwater.image_io import write_exr
from headwater.tile_test import tile_test
from headwater.usd_scene import StageSync, open_stage

mitsuba = pytest.importorskip("mitsuba")

SIZE = 32
RUNS = 6
SAMPLES = 64  # a pixel and run; Mitsuba takes four times as many, so that its noise matters little
MAX_BOUNCES = 3
TILES = 4


def new_stage(tmp_path):
    """A Y-up stage in metres, so that its space is Mitsuba's too."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    return stage


def look_at(origin, target):
    """Camera to world for a camera that looks along its −z, row vectors."""
    return Gf.Matrix4d().SetLookAt(Gf.Vec3d(*origin), Gf.Vec3d(*target), Gf.Vec3d(0, 1, 0)).GetInverse()


def camera(stage, origin, target, angle):
    result = UsdGeom.Camera.Define(stage, "/camera")
    result.AddTransformOp().Set(look_at(origin, target))
    result.CreateFocalLengthAttr(10.0)
    result.CreateHorizontalApertureAttr(20 * math.tan(math.radians(angle) / 2))
    result.CreateVerticalApertureAttr(20 * math.tan(math.radians(angle) / 2))
    result.CreateClippingRangeAttr((0.01, 1000))


def mesh(stage, path, points, faces, color):
    result = UsdGeom.Mesh.Define(stage, path)
    result.CreatePointsAttr(points)
    result.CreateFaceVertexCountsAttr([len(face) for face in faces])
    result.CreateFaceVertexIndicesAttr([i for face in faces for i in face])
    result.CreateSubdivisionSchemeAttr("none")
    result.CreateDisplayColorAttr([color])
    return result


def box(stage, path, low, high, color, turn=0.0):
    (a, b, c), (x, y, z) = low, high
    points = [(a, b, c), (x, b, c), (x, y, c), (a, y, c), (a, b, z), (x, b, z), (x, y, z), (a, y, z)]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (0, 4, 7, 3)]
    mesh(stage, path, points, faces, color).AddRotateYOp().Set(turn)


def cornell_box(tmp_path):
    """A closed box with coloured walls, two blocks, and one rectangle of light."""
    stage = new_stage(tmp_path)
    camera(stage, (0, 1, 3.9), (0, 1, 0), 38)
    wall = (0.7, 0.7, 0.7)
    mesh(stage, "/floor", [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 3, 2, 1)], wall)
    mesh(stage, "/ceiling", [(-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)], [(0, 1, 2, 3)], wall)
    mesh(stage, "/back", [(-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1)], [(0, 1, 2, 3)], wall)
    mesh(stage, "/left", [(-1, 0, -1), (-1, 0, 1), (-1, 2, 1), (-1, 2, -1)], [(0, 3, 2, 1)], (0.6, 0.05, 0.05))
    mesh(stage, "/right", [(1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1)], [(0, 1, 2, 3)], (0.1, 0.5, 0.1))
    box(stage, "/tall", (-0.6, 0, -0.6), (-0.1, 1.2, -0.1), wall, 17)
    box(stage, "/short", (0.15, 0, 0.1), (0.65, 0.6, 0.6), (0.3, 0.4, 0.7), -16)
    light = UsdLux.RectLight.Define(stage, "/light")
    light.CreateWidthAttr(0.5)
    light.CreateHeightAttr(0.8)
    light.CreateIntensityAttr(3)
    light.CreateExposureAttr(1.5)
    light.CreateColorAttr((1, 0.8, 0.6))
    light.AddTranslateOp().Set((0.1, 1.98, 0))
    light.AddRotateXOp().Set(-90)
    return stage


def many_kinds(tmp_path):
    """A court under a sphere, a disk, a sun and a point of light."""
    stage = new_stage(tmp_path)
    camera(stage, (3, 3, 5), (0, 0.4, 0), 45)
    mesh(stage, "/ground", [(-6, 0, -6), (6, 0, -6), (6, 0, 6), (-6, 0, 6)], [(0, 3, 2, 1)], (0.6, 0.55, 0.5))
    box(stage, "/a", (-1.4, 0, -1), (-0.4, 1.5, 0), (0.7, 0.2, 0.2), 30)
    box(stage, "/b", (0.3, 0, 0.2), (1.2, 0.8, 1.1), (0.2, 0.3, 0.7), 10)
    sphere = UsdLux.SphereLight.Define(stage, "/sphere")
    sphere.CreateRadiusAttr(0.3)
    sphere.CreateIntensityAttr(6)
    sphere.CreateColorAttr((1, 0.6, 0.3))
    sphere.AddTranslateOp().Set((-0.2, 1.0, 1.6))
    disk = UsdLux.DiskLight.Define(stage, "/disk")
    disk.CreateRadiusAttr(0.5)
    disk.CreateIntensityAttr(20)
    disk.CreateNormalizeAttr(True)
    disk.CreateColorAttr((0.3, 0.6, 1))
    disk.AddTransformOp().Set(look_at((-2.5, 2, 1), (0, 0.3, 0)))
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.CreateAngleAttr(0)
    sun.CreateIntensityAttr(0.8)
    sun.AddTransformOp().Set(look_at((1, 2, -1.5), (0, 0, 0)))
    point = UsdLux.SphereLight.Define(stage, "/point")
    point.CreateTreatAsPointAttr(True)
    point.CreateRadiusAttr(0.05)
    point.CreateIntensityAttr(300)
    point.AddTranslateOp().Set((1.8, 1.2, -0.5))
    return stage


def under_a_sky(tmp_path):
    """Boxes on a ground under a textured sky, turned about two axes, with a small sphere of light."""
    stage = new_stage(tmp_path)
    camera(stage, (2, 2.2, 4), (0, 0.5, 0), 42)
    mesh(stage, "/ground", [(-3, 0, -3), (3, 0, -3), (3, 0, 3), (-3, 0, 3)], [(0, 3, 2, 1)], (0.5, 0.5, 0.5))
    box(stage, "/a", (-1, 0, -0.8), (0, 1.1, 0.2), (0.8, 0.6, 0.2), 25)
    sphere = UsdGeom.Mesh.Define(stage, "/ball")
    sphere_mesh(sphere, (0.8, 0.6, 0.3), 0.6)
    # Rows lie at texel centres in UsdLux's map; Mitsuba spreads them from pole to pole.
    for name, v in (("sky.exr", (np.arange(256) + 0.5) / 256), ("mitsuba_sky.exr", np.arange(256) / 255)):
        write_exr(str(tmp_path / name), {"Combined": sky_picture(v)[::-1]}, depth="float")
    dome = UsdLux.DomeLight.Define(stage, "/dome")
    dome.CreateTextureFileAttr("./sky.exr")
    dome.CreateIntensityAttr(0.7)
    dome.AddRotateXOp().Set(-20)
    dome.AddRotateYOp().Set(110)
    lamp = UsdLux.SphereLight.Define(stage, "/lamp")
    lamp.CreateRadiusAttr(0.1)
    lamp.CreateIntensityAttr(40)
    lamp.AddTranslateOp().Set((0.3, 1.5, 1.2))
    return stage


def sky_picture(v, width=512):
    """A smooth sky (rows, width, 4), top row first, with rows at heights `v` from the top."""
    v, u = np.meshgrid(v, (np.arange(width) + 0.5) / width, indexing="ij")
    lobe = np.exp(-30 * (np.square(np.minimum(abs(u - 0.3), 1 - abs(u - 0.3))) + np.square(v - 0.3)))
    sky = np.ones((*v.shape, 4), np.float32)
    sky[..., 0] = 0.3 + 6 * lobe
    sky[..., 1] = 0.3 + 4 * lobe + 0.3 * np.square(np.cos(np.pi * u))
    sky[..., 2] = 0.7 - 0.4 * v
    return sky


def sphere_mesh(target, centre, radius, rings=24):
    """A ball of quads, flat shaded in both renderers."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(2 * rings) * np.pi / rings, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], axis=-1).reshape(
        -1, 3
    )
    n = 2 * rings
    faces = [
        (r * n + i, (r + 1) * n + i, (r + 1) * n + (i + 1) % n, r * n + (i + 1) % n)
        for r in range(rings)
        for i in range(n)
    ]
    target.CreatePointsAttr([tuple(p) for p in points * radius + centre])
    target.CreateFaceVertexCountsAttr([4] * len(faces))
    target.CreateFaceVertexIndicesAttr([i for face in faces for i in face])
    target.CreateSubdivisionSchemeAttr("none")
    target.CreateDisplayColorAttr([(0.2, 0.7, 0.6)])


# Mitsuba's side


def transform(matrix):
    return mitsuba.ScalarTransform4f(np.array(matrix, float).T)


def area_emitter(radiance):
    return {"type": "area", "radiance": {"type": "rgb", "value": [float(v) for v in radiance]}}


def mitsuba_mesh(prim, to_world, folder):
    points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)
    points = points @ np.array(to_world)[:3, :3] + np.array(to_world)[3, :3]
    counts = np.array(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get())
    indices = np.array(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get())
    color = UsdGeom.Mesh(prim).GetDisplayColorAttr().Get()[0]
    triangles, start = [], 0
    for count in counts:
        face = indices[start : start + count]
        triangles += [(face[0], face[i], face[i + 1]) for i in range(1, count - 1)]
        start += count
    path = folder / f"{prim.GetName()}.ply"
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(repr, map(float, p))) for p in points] + [f"3 {a} {b} {c}" for a, b, c in triangles]
    path.write_text(header + "\n".join(rows) + "\n")
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [float(c) for c in color]}}
    bsdf = {"type": "twosided", "bsdf": diffuse}
    return {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": bsdf}


def mitsuba_light(prim, to_world, folder):
    """An emitter by the definitions of UsdLux."""
    api = UsdLux.LightAPI(prim)
    radiance = np.array(api.GetColorAttr().Get()) * api.GetIntensityAttr().Get() * 2 ** api.GetExposureAttr().Get()
    through = {"type": "null"}  # lamps stop no light, as in Blender
    turn = mitsuba.ScalarTransform4f
    if prim.IsA(UsdLux.RectLight):
        light = UsdLux.RectLight(prim)
        half = [light.GetWidthAttr().Get() / 2, light.GetHeightAttr().Get() / 2, 1]
        # Mitsuba's rectangle shines along its +z, UsdLux's along −z.
        place = transform(to_world) @ turn().rotate([1, 0, 0], 180) @ turn().scale(half)
        return {"type": "rectangle", "to_world": place, "bsdf": through, "emitter": area_emitter(radiance)}
    if prim.IsA(UsdLux.DiskLight):
        radius = UsdLux.DiskLight(prim).GetRadiusAttr().Get()
        if api.GetNormalizeAttr().Get():
            radiance = radiance / (math.pi * radius**2)
        place = transform(to_world) @ turn().rotate([1, 0, 0], 180) @ turn().scale([radius, radius, 1])
        return {"type": "disk", "to_world": place, "bsdf": through, "emitter": area_emitter(radiance)}
    if prim.IsA(UsdLux.SphereLight):
        light = UsdLux.SphereLight(prim)
        radius, centre = light.GetRadiusAttr().Get(), [float(v) for v in np.array(to_world)[3, :3]]
        if light.GetTreatAsPointAttr().Get():
            intensity = {"type": "rgb", "value": [float(v) for v in radiance * math.pi * radius**2]}
            return {"type": "point", "position": centre, "intensity": intensity}
        shape = {"type": "sphere", "center": centre, "radius": radius}
        return shape | {"bsdf": through, "emitter": area_emitter(radiance)}
    if prim.IsA(UsdLux.DistantLight):
        direction = [float(-v) for v in np.array(to_world)[2, :3]]
        irradiance = {"type": "rgb", "value": [float(v) for v in radiance]}  # angle 0: intensity is irradiance
        return {"type": "directional", "direction": direction, "irradiance": irradiance}
    # Mitsuba's environment has +y up, its centre at +z and +x left of it, as UsdLux's latlong maps.
    file = str(folder / "mitsuba_sky.exr")
    return {"type": "envmap", "filename": file, "scale": float(radiance[0]), "to_world": transform(to_world)}


def mitsuba_scene(stage, folder):
    scene = {"type": "scene", "integrator": {"type": "volpath", "max_depth": MAX_BOUNCES + 2, "rr_depth": 100}}
    cache = UsdGeom.XformCache()
    for prim in stage.Traverse():
        to_world = cache.GetLocalToWorldTransform(prim)
        if prim.IsA(UsdGeom.Mesh):
            scene[prim.GetName()] = mitsuba_mesh(prim, to_world, folder)
        elif prim.HasAPI(UsdLux.LightAPI):
            scene[prim.GetName()] = mitsuba_light(prim, to_world, folder)
        elif prim.IsA(UsdGeom.Camera):
            usd = UsdGeom.Camera(prim)
            angle = 2 * math.atan(usd.GetHorizontalApertureAttr().Get() / 2 / usd.GetFocalLengthAttr().Get())
            matrix = np.array(to_world)
            origin, backward, up = matrix[3, :3], matrix[2, :3], matrix[1, :3]
            place = mitsuba.ScalarTransform4f().look_at(
                origin=origin.tolist(), target=(origin - backward).tolist(), up=up.tolist()
            )
            film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}}
            film |= {"pixel_format": "rgb", "component_format": "float32"}
            scene["sensor"] = {"type": "perspective", "fov": math.degrees(angle), "to_world": place, "film": film}
            scene["sensor"] |= {"near_clip": 0.01, "far_clip": 1000.0, "sampler": {"type": "independent"}}
    return mitsuba.load_dict(scene)


def mitsuba_runs(stage, folder):
    mitsuba.set_variant("scalar_rgb")
    scene = mitsuba_scene(stage, folder)
    return [np.array(mitsuba.render(scene, seed=100 + run, spp=4 * SAMPLES)) for run in range(RUNS)]


# Our side


def headwater_runs(core, context, path, lights="power"):
    scene = core.Scene()
    StageSync(open_stage(path), scene, flags=core.flags).sync(0.0, aspect=1.0)
    session = core.Session(context, scene)
    session.sync()
    images = []
    for run in range(RUNS):
        session.start(
            {
                "width": SIZE,
                "height": SIZE,
                "region": (0, 0, SIZE, SIZE),
                "samples": SAMPLES,
                "seed": 1000 + run,
                "integrator": "path",
                "lights": lights,
                "filter": "BOX",
                "filter_width": 1.0,
                "max_bounces": MAX_BOUNCES,
                "diffuse_bounces": MAX_BOUNCES,
                "passes": ["Combined"],
            }
        )
        while not session.wait(1000):
            pass
        session.finish()
        images.append(session.read("Combined")[::-1, :, :3].copy())
    return images


@pytest.mark.parametrize("make", [cornell_box, many_kinds, under_a_sky])
def test_path_equals_mitsuba(core, make_context, tmp_path, make):
    stage = make(tmp_path)
    stage.GetRootLayer().Save()
    ours = headwater_runs(core, make_context(), str(tmp_path / "scene.usda"))
    theirs = mitsuba_runs(stage, tmp_path)
    result = tile_test(ours, theirs, TILES)
    means = np.mean(ours, axis=(0, 1, 2)), np.mean(theirs, axis=(0, 1, 2))
    assert result.p_family > 1e-4, f"tile {result.worst_tile}: z {result.worst_z:.1f}; means {means}"
    whole = tile_test(ours, theirs, 1)
    assert abs(whole.worst_z) < 4, f"means {means}"
    # The test has teeth: three per cent more light in one of the two would be found in the whole picture.
    assert abs(tile_test([1.03 * image for image in ours], theirs, 1).worst_z) > 4

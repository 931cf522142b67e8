# SPDX-License-Identifier: Apache-2.0
"""Random damage with fixed seeds: image files, USD files, .blend files, material programs. Each is taken, or refused
with the error that is meant for it; nothing crashes, hangs, or gives pixels that are no numbers.

Every test runs in a process of its own that must end well and in time.
"""

import os
import subprocess
import sys
import textwrap

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

MUTATE = """
import random
def mutate(data, seed):
    '''Cut off, some bytes changed, header bytes changed to extremes, or a run overwritten.'''
    r, data = random.Random(seed), bytearray(data)
    kind = r.randrange(4)
    if kind == 0:
        return bytes(data[: r.randrange(len(data))])
    if kind == 1:
        for _ in range(r.randrange(1, 20)):
            data[r.randrange(len(data))] = r.randrange(256)
    if kind == 2:
        for _ in range(r.randrange(1, 6)):
            data[r.randrange(min(600, len(data)))] = r.choice((0, 1, 127, 128, 255))
    if kind == 3:
        at, count = r.randrange(len(data)), r.randrange(1, 64)
        data[at : at + count] = r.randbytes(count)
    return bytes(data)
"""


def survives(code, folder, timeout):
    """Runs the code in `folder`; returns what it printed. AssertionError when the process dies or takes too long."""
    program = f"import sys; sys.path.insert(0, {ROOT!r})\n" + MUTATE + textwrap.dedent(code)
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", program],
        cwd=folder,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
    )
    assert done.returncode == 0, f"died with {done.returncode}\n{done.stdout[-500:]}\n{done.stderr[-3000:]}"
    return done.stdout


def test_image_files(tmp_path):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    code = """
    import io, struct
    import numpy as np, OpenEXR
    from PIL import Image
    from headwater.errors import UserError
    from headwater.exr_structure import exr_damage
    from headwater.texture_io import load_texture
    noise = np.random.default_rng(7).random((33, 47, 3)).astype(np.float32)
    seeds = {}
    for name in ("ZIP", "PIZ", "DWAA", "RLE", "NO", "PXR24"):
        header = {"compression": getattr(OpenEXR, name + "_COMPRESSION"), "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"RGB": noise}).write("seed.exr")
        seeds[name] = open("seed.exr", "rb").read()
        assert exr_damage("seed.exr") == ""
        assert all(exr_damage(seeds[name][:n]) for n in range(4, len(seeds[name]), 7)), "a cut file counts as whole"
    for name in ("PNG", "JPEG", "TIFF", "BMP", "TGA"):
        file = io.BytesIO()
        Image.fromarray((noise * 255).astype(np.uint8)).save(file, name)
        seeds[name] = file.getvalue()
    rgbe = np.concatenate([(noise * 255).astype(np.uint8), np.full((33, 47, 1), 128, np.uint8)], axis=2)
    head = b"#?RADIANCE\\nFORMAT=32-bit_rle_rgbe\\n\\n-Y 33 +X 47\\n"
    seeds["HDR"] = head + rgbe.tobytes()
    runs = lambda row: b"\\2\\2" + struct.pack(">H", 47) + b"".join(b"\\x2f" + row[:, c].tobytes() for c in range(4))
    seeds["HDR runs"] = head + b"".join(runs(row) for row in rgbe)
    taken = refused = 0
    for name, data in seeds.items():
        open("image", "wb").write(data)
        assert load_texture("image").pixels.shape == (33, 47, 3), name
        for i in range(60):
            open("image", "wb").write(mutate(data, f"{name} {i}"))
            try:
                texture = load_texture("image")
                assert texture.pixels.ndim == 3
                taken += 1
            except UserError as error:
                assert "image" in str(error) and "\\n" not in str(error), str(error)
                refused += 1
    print(taken, refused)
    """
    taken, refused = map(int, survives(code, tmp_path, 500).split()[-2:])
    assert taken > 100 and refused > 100


def test_usd_files(core, tmp_path):
    pytest.importorskip("pxr")
    code = """
    import os
    from pxr import Usd, UsdGeom, UsdLux
    import headwater._core as core
    from headwater.errors import UserError
    from headwater.usd_scene import StageSync, open_stage
    from headwater.usd_scene.stage import reading
    stage = Usd.Stage.CreateNew("seed.usdc")
    mesh = UsdGeom.Mesh.Define(stage, "/mesh")
    mesh.CreatePointsAttr([(i, i * i % 7, i % 3) for i in range(300)])
    mesh.CreateFaceVertexCountsAttr([3] * 100)
    mesh.CreateFaceVertexIndicesAttr(list(range(300)))
    UsdGeom.Camera.Define(stage, "/camera")
    UsdLux.SphereLight.Define(stage, "/lamp")
    stage.GetRootLayer().Save()
    stage.GetRootLayer().Export("seed.usda")
    taken = refused = 0
    for name in ("seed.usdc", "seed.usda"):
        data = open(name, "rb").read()
        for i in range(100):
            path = f"{i}{os.path.splitext(name)[1]}"
            open(path, "wb").write(mutate(data, f"{name} {i}"))
            try:
                opened = open_stage(path)
                with reading(path):
                    StageSync(opened, core.Scene(), warn=lambda t: None, flags=core.flags).sync(1, aspect=1.0)
                taken += 1
            except UserError as error:
                assert "\\n" not in str(error)
                refused += 1
    print(taken, refused)
    """
    taken, refused = map(int, survives(code, tmp_path, 500).split()[-2:])
    assert taken > 20 and refused > 50


def test_blend_files_that_end_early(core, tmp_path):
    """Cut at any place, compressed or not, and followed by noise: one error, and Blender opens the whole file after."""
    pytest.importorskip("bpy")
    code = """
    import random
    import bpy
    from headwater import blend, render_request
    from headwater.errors import UserError
    kinds = ("plain.blend", False), ("packed.blend", True)
    for name, compress in kinds:
        bpy.ops.wm.save_as_mainfile(filepath=name, compress=compress)
        data = open(name, "rb").read()
        r = random.Random(name)
        class Request:
            file, autoexec = name, False
        for i in range(12):
            cut = data[: r.randrange(16, len(data) - 64)]
            open("cut.blend", "wb").write(cut if i % 2 else data[:12] + r.randbytes(len(cut)))
            Request.file = "cut.blend"
            try:
                blend._open(bpy, Request)
            except UserError as error:
                assert "cut.blend" in str(error) and "\\n" not in str(error), str(error)
            else:
                raise AssertionError(f"{name} {i} was taken")
        Request.file = name
        blend._open(bpy, Request)
        assert "Cube" in bpy.data.objects
    import os; print("done", flush=True); os._exit(0)
    """
    assert "done" in survives(code, tmp_path, 500)


def test_material_programs(core, tmp_path):
    """Random rows, half of them well-formed, with constants that are huge or no numbers: those the core takes are
    rendered side by side, as surfaces and as emission, and give a picture of finite numbers in time."""
    code = """
    import random
    import numpy as np
    import headwater._core as core
    ops = core.material_ops
    MAGIC, CONSTANT = 0x48570001, 0x8000
    values = [c for c in ops.values() if c < 96]
    closures = [c for n, c in ops.items() if 96 <= c < 255 and n not in ("HW_OP_PRINCIPLED", "HW_OP_ARGUMENTS")]
    extremes = (0, 1, -1, 0.5, 2, 1e30, -1e30, 1e-30, 3e38, float("nan"), float("inf"), -float("inf"), 1000, 16)

    def section(r, wild):
        rows, written = [], [0, 1, 2, 3]
        def operand():
            return r.choice(written) if r.random() < 0.5 else CONSTANT | r.randrange(40)
        for _ in range(r.randrange(1, 8)):
            op = r.choice(values)
            sub = r.choice((0, 0, 1, 2, 16, 17, 49, 64 | 9, 1 << 9 | 64 * 3, r.randrange(1 << 16)))
            to = 4 + r.randrange(20)
            row = [op | to << 8 | sub << 16, operand() | operand() << 16, operand() | 0 << 16,
                   r.randrange(2) if op in (38, 33, 34) else operand() | operand() << 16]
            rows.append(row)
            written.append(to)
        for _ in range(r.randrange(1, 4)):
            sub = r.choice((0, 0, 1, 2, 4, r.randrange(1 << 16)))
            rows.append([r.choice(closures) | sub << 16] + [operand() | operand() << 16 for _ in range(3)])
        rows.append([255, 0, 0, 0])
        if wild:
            for _ in range(r.randrange(1, 3)):
                rows[r.randrange(len(rows))][r.randrange(4)] ^= 1 << r.randrange(32)
        return rows

    scene = core.Scene()
    eye = np.eye(4, dtype=np.float32)[:3].copy()
    eye[2, 3] = 30
    scene.set_camera("perspective", eye, (-0.4, 0.4, -0.4, 0.4))
    scene.set_world("white", (1, 1, 1))
    quad = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    scene.upsert_mesh(1, "quad", quad, np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
                      attributes=[("uv", core.flags["HW_DOMAIN_VERTEX"], quad[:, :2].copy())], default_uv=0)
    scene.upsert_image(1, "image", np.full((1, 1, 4), 128, np.uint8))
    scene.upsert_image(2, "missing", None)
    accepted = refused = 0
    for i in range(4000):
        r = random.Random(i)
        rows = section(r, r.random() < 0.5)
        starts = [1, 1, 1] if r.random() < 0.3 else [1, 0, 0]
        program = np.array([[MAGIC, *starts], *rows], np.uint32).reshape(-1)
        constants = np.array([[r.choice(extremes) for _ in range(4)] for _ in range(40)], np.float32)
        try:
            scene.upsert_material(i + 1, f"random {i}", program, constants, images=[1, 2],
                                  flags=core.flags["HW_MATERIAL_EMISSION_SHADER"] if starts[1] else 0)
        except core.SceneError as error:
            assert f"random {i}" in str(error), str(error)
            refused += 1
            continue
        place = eye * 0 + np.eye(4, dtype=np.float32)[:3]
        place[:, 3] = accepted % 24 - 12, accepted // 24 - 12, 0
        scene.upsert_instance(accepted + 1, 1, place.astype(np.float32), materials=[i + 1])
        accepted += 1
        if accepted == 24 * 24:
            break
    session = core.Session(core.Context(), scene)
    session.sync()
    passes = ["Combined", "Normal", "Diffuse Color", "Glossy Color", "Transmission Color", "Emission"]
    session.start({"width": 48, "height": 48, "samples": 1, "max_bounces": 2, "passes": passes})
    assert session.wait(400_000), session.progress()
    session.finish()
    for name in passes:
        pixels = session.read(name)
        assert np.isfinite(pixels).all(), (name, int((~np.isfinite(pixels)).sum()))
    assert session.read("Combined")[..., :3].any()
    print(accepted, refused)
    """
    accepted, refused = map(int, survives(code, tmp_path, 500).split()[-2:])
    assert accepted > 200 and refused > 200

# SPDX-License-Identifier: Apache-2.0
"""A test double of `headwater._core` (docs/architecture.md): checks and records edits, renders constant pixels."""

import sys
import threading
import time

import numpy as np

from headwater.integrators import INTEGRATORS, PARAMETERS, Choice, Number, Whole

flags = {
    name: bit
    for names in (
        "HW_LIGHT_CAST_SHADOW=1 HW_LIGHT_USE_MIS=2 HW_LIGHT_ELLIPSE=4 HW_LIGHT_CAMERA=8 HW_LIGHT_DIFFUSE=16",
        "HW_LIGHT_GLOSSY=32 HW_LIGHT_TRANSMISSION=64 HW_LIGHT_SHADER=128 HW_LIGHT_SOFT_FALLOFF=512",
        "HW_MASK_CAMERA=1 HW_MASK_DIFFUSE=2 HW_MASK_GLOSSY=4 HW_MASK_TRANSMISSION=8 HW_MASK_SHADOW_OPAQUE=16",
        "HW_INSTANCE_HOLDOUT=2 HW_INSTANCE_SHADOW_CATCHER=4",
        "HW_MATERIAL_EMISSIVE=1 HW_MATERIAL_EMISSION_SHADER=2 HW_MATERIAL_TRANSPARENT=4 HW_MATERIAL_NO_MIS=8",
        "HW_MATERIAL_EMIT_FRONT=16 HW_MATERIAL_EMIT_BACK=32",
    )
    for name, _, number in (part.partition("=") for part in names.split())
    for bit in (int(number),)
}
PASSES = {
    "Combined": 4, "Depth": 1, "Position": 3, "Normal": 3, "Vector": 4, "UV": 3, "Mist": 1, "Object Index": 1,
    "Material Index": 1, "Denoising Normal": 3, "Denoising Albedo": 3, "Denoising Depth": 1,
    "Diffuse Direct": 3, "Diffuse Indirect": 3,
    "Diffuse Color": 3, "Glossy Direct": 3, "Glossy Indirect": 3, "Glossy Color": 3, "Transmission Direct": 3,
    "Transmission Indirect": 3, "Transmission Color": 3, "Emission": 3, "Environment": 3,
}  # fmt: skip
material_ops = {}
sessions = []  # every Session made, the newest last
render_seconds = 0.0  # how long a render takes
fail_with = None  # an exception that Session.finish raises


class SceneError(ValueError):
    pass


def _array(what, value, dtype, *shape):
    if value.dtype != dtype or not value.flags.c_contiguous or value.ndim != len(shape):
        raise TypeError(f"{what}: {value.dtype} {value.shape}, wanted contiguous {dtype} {shape}")
    for have, want in zip(value.shape, shape):
        if want is not None and have != want:
            raise SceneError(f"{what}: shape {value.shape}, wanted {shape}")
    if value.dtype == np.float32 and not np.isfinite(value).all():
        raise SceneError(f"{what}: not finite")


class Scene:
    """Holds what was sent. `log` lists the edits since the last commit as (name, id)."""

    def __init__(self):
        self.meshes, self.instances, self.lights, self.materials, self.images = {}, {}, {}, {}, {}
        self.world = self.camera = None
        self.log = []

    def upsert_mesh(self, id, name, positions, tri_vertices, *, tri_corners=None, normals=None, tri_slots=None,
                    attributes=(), tangents=(), default_uv=-1, lend=False):  # fmt: skip
        _array(name, positions, np.float32, None, 3)
        _array(name, tri_vertices, np.uint32, None, 3)
        count = len(tri_vertices)
        if not count:
            raise SceneError(f"mesh '{name}' is empty")
        if tri_vertices.max() >= len(positions):
            raise SceneError(f"mesh '{name}': vertex out of range")
        if tri_corners is not None:
            _array(name, tri_corners, np.uint32, count, 3)
        corners = int((tri_vertices if tri_corners is None else tri_corners).max()) + 1
        if normals is not None:
            _array(name, normals, np.float32, None, 3)
            assert len(normals) >= corners
        if tri_slots is not None:
            _array(name, tri_slots, np.uint8, count)
        sizes = {"vertex": len(positions), "corner": corners, "face": count}
        for label, domain, values in attributes:
            _array(f"{name}.{label}", values, np.float32, None, None)
            assert len(values) >= sizes[domain]
        assert -1 <= default_uv < len(attributes) and len(attributes) + len(tangents) <= 8
        for label, uv in tangents:
            assert attributes[uv][1] != "face" and attributes[uv][2].shape[1] >= 2, label
        self.meshes[id] = dict(name=name, positions=positions.copy(), tri_vertices=tri_vertices.copy(), normals=normals,
                               tri_slots=tri_slots, tri_corners=tri_corners,
                               attributes={a[0]: a for a in attributes}, tangents=list(tangents), default_uv=default_uv,
                               triangles=count)  # fmt: skip
        self.log.append(("mesh", id))

    def _instance(self, id, mesh, matrix, settings):
        if mesh not in self.meshes:
            raise SceneError(f"instance '{settings.get('name')}': no mesh {mesh}")
        for material in settings.get("materials", ()):
            if material and material not in self.materials:
                raise SceneError(f"instance '{settings.get('name')}': no material {material}")
        self.instances[id] = dict(settings, mesh=mesh, matrix=matrix.copy())

    def upsert_instance(self, id, mesh, matrix, *, name="", materials=(), visibility=31, object_index=0, random_id=0,
                        flags=0, color=(1, 1, 1), shadow_terminator_offset=0.1, moves=False):  # fmt: skip
        settings = {k: v for k, v in locals().items() if k not in ("self", "id", "mesh", "matrix")}
        _array(name, matrix, np.float32, 3, 4)
        self._instance(id, mesh, matrix, settings)
        self.log.append(("instance", id))

    def upsert_instances(self, first_id, mesh, matrices, *, random_ids=None, name="", materials=(), visibility=31,
                         object_index=0, flags=0, color=(1, 1, 1), shadow_terminator_offset=0.1,
                         moves=False):  # fmt: skip
        settings = {
            k: v for k, v in locals().items() if k not in ("self", "first_id", "mesh", "matrices", "random_ids")
        }
        _array(name, matrices, np.float32, None, 3, 4)
        if random_ids is not None:
            _array(name, random_ids, np.uint32, len(matrices))
        for i, matrix in enumerate(matrices):
            self._instance(first_id + i, mesh, matrix, dict(settings, random_id=int(random_ids[i])))
        self.log.append(("instances", first_id))

    def upsert_lights(self, ids, name, kind, matrices, *, color, power, flags, normalize=True, **shape):
        allowed = {
            "point": {"radius"}, "spot": {"radius", "spot_size", "spot_blend"}, "sun": {"angle"},
            "area": {"size_x", "size_y", "ellipse", "spread"},
        }  # fmt: skip
        assert set(shape) <= allowed[kind], (kind, shape)
        _array(name, ids, np.uint64, None)
        _array(name, matrices, np.float32, len(ids), 3, 4)
        for id, matrix in zip(ids.tolist(), matrices, strict=True):
            self.lights[id] = dict(shape, name=name, kind=kind, matrix=matrix.copy(), color=color, power=power,
                                   flags=flags, normalize=normalize)  # fmt: skip
            self.log.append(("light", id))

    def upsert_light(self, id, name, kind, matrix, **settings):
        _array(name, matrix, np.float32, 3, 4)
        self.upsert_lights(np.array([id], np.uint64), name, kind, matrix[None], **settings)

    def upsert_material(self, id, name, program, constants, images=(), flags=0, emission=(0, 0, 0), pass_index=0):
        _array(name, program, np.uint32, None)
        _array(name, constants, np.float32, None, 4)
        assert all(image in self.images for image in images)
        self.materials[id] = dict(name=name, flags=flags, emission=emission, pass_index=pass_index)
        self.log.append(("material", id))

    def upsert_image(self, id, name, pixels, *, srgb=False, premultiplied=False, lend=False):
        self.images[id] = dict(name=name, shape=None if pixels is None else pixels.shape, srgb=srgb)
        self.log.append(("image", id))

    def set_world(self, name, color, material=0, importance_width=0, sample=True, flags=0):
        self.world = dict(name=name, color=color, material=material, sample=sample, flags=flags, width=importance_width)
        self.log.append(("world", 0))

    def set_camera(
        self,
        kind,
        matrix,
        plane,
        *,
        clip,
        aperture_radius=0,
        focus_distance=1,
        blades=0,
        rotation=0,
        ratio=1,
        panorama="equirectangular",
        range=(0, 0, 0, 0),
        lens=(0, 0, 0, 0),
    ):
        _array("camera", matrix, np.float32, 3, 4)
        self.camera = {k: v for k, v in locals().items() if k != "self"}
        self.log.append(("camera", 0))

    def has_mesh(self, id):
        return id in self.meshes

    def remove_mesh(self, id):
        users = [i["name"] for i in self.instances.values() if i["mesh"] == id]
        if users:
            raise SceneError(f"mesh {id} is used by {users}")
        del self.meshes[id]
        self.log.append(("remove_mesh", id))

    def remove_instance(self, id):
        del self.instances[id]
        self.log.append(("remove_instance", id))

    def remove_instances(self, first_id, count):
        for i in range(count):
            del self.instances[first_id + i]
        self.log.append(("remove_instances", first_id))

    def remove_lights(self, ids):
        _array("lights", ids, np.uint64, None)
        for id in ids.tolist():
            del self.lights[id]
            self.log.append(("remove_light", id))

    def remove_light(self, id):
        self.remove_lights(np.array([id], np.uint64))

    def remove_material(self, id):
        assert not any(id in i["materials"] for i in self.instances.values()), "material in use"
        del self.materials[id]
        self.log.append(("remove_material", id))

    def remove_image(self, id):
        del self.images[id]
        self.log.append(("remove_image", id))

    def named(self, kind, name):
        """The things of a kind ("meshes", "instances", "lights", "materials") with that name."""
        return [thing for thing in getattr(self, kind).values() if thing["name"] == name]


class Context:
    def __init__(self, device="", tracer="auto", threads=0, validation=False):
        if device not in ("", "Fake"):
            raise RuntimeError(f"no device is called '{device}'; there are: Fake")
        self.device, self.tracer, self.threads = {"name": "Fake"}, tracer, threads
        self.memory = self.peak_memory = self.validation_messages = 0
        self.shared_memory = False

    def set_memory_limit(self, size):
        self.limit = size


class ImageDecoder:
    """Decodes nothing: Blender reads every image."""

    def __init__(self, threads=0):
        self.files = 0

    def add(self, file):
        assert isinstance(file, (bytes, str))
        self.files += 1
        return self.files - 1

    def done(self, number):
        return True

    def take(self, number):
        assert number < self.files
        return None


class Session:
    def __init__(self, context, scene):
        self.context, self.scene = context, scene
        self.edits, self.settings, self.cancelled = [], [], threading.Event()
        self._end = 0.0
        sessions.append(self)

    def sync(self):
        self.edits.append(self.scene.log)
        self.scene.log = []
        return {"commit_seconds": 0.0, "upload_seconds": 0.0, "build_seconds": 0.0}

    def start(self, settings):
        reservoir_bytes(settings)
        for name in settings["passes"]:
            if name not in PASSES:
                raise ValueError(f"unknown pass '{name}'")
        self.settings.append(dict(settings))
        self.cancelled.clear()
        self._start, self._end = time.perf_counter(), time.perf_counter() + render_seconds

    def wait(self, milliseconds):
        end = min(self._end, time.perf_counter() + milliseconds / 1000)
        self.cancelled.wait(max(0.0, end - time.perf_counter()))
        return self.cancelled.is_set() or time.perf_counter() >= self._end

    def progress(self):
        samples = self.settings[-1]["samples"] if self.settings else 0
        part = 1.0 if time.perf_counter() >= self._end else (time.perf_counter() - self._start) / render_seconds
        return {
            "sample": int(samples * part), "samples": samples, "rays": 0, "mrays": 1.0, "seconds": 0.1,
            "remaining": 1.0, "memory": 1 << 20, "stage": "", "error": "",
            "cancelled": self.cancelled.is_set(),
        }  # fmt: skip

    def cancel(self):
        self.cancelled.set()

    def finish(self):
        if fail_with is not None:
            raise fail_with

    def passes(self):
        return [(name, PASSES[name]) for name in self.settings[-1]["passes"]]

    def read(self, name, out=None):
        x0, y0, x1, y1 = self.settings[-1]["region"]
        channels = PASSES[name]
        order = list(PASSES).index(name)
        pixels = np.empty((y1 - y0, x1 - x0, channels), np.float32)
        pixels[...] = order + np.arange(1, channels + 1) / 10
        if name == "Combined":
            pixels[..., 0] = np.arange(x0, x1) / 1000
            pixels[..., 1] = np.arange(y0, y1)[:, None] / 1000
            pixels[..., 3] = 1.0
        return pixels

    def stats(self):
        return {"rays": 0, "seconds": 0.0, "stages": {}}


def _refuse_reuse(settings):
    """ValueError for an unknown integrator or estimator and for a parameter that it does not read or take."""
    integrator = INTEGRATORS.get(settings["integrator"])
    if integrator is None:
        raise ValueError(f"no integrator '{settings['integrator']}'; there are {', '.join(INTEGRATORS)}")
    estimator = settings.get("estimator", "paper")
    if estimator not in ("paper", "unbiased"):
        raise ValueError(f"no estimator '{estimator}'; there are paper, unbiased")
    for name, parameter in PARAMETERS.items():
        value = settings.get(name)
        if value is None:
            continue
        if name not in integrator.parameters(estimator):
            raise ValueError(f"integrator '{integrator.name}' has no parameter '{name}'")
        if isinstance(parameter, (Whole, Number)) and not parameter.least <= value <= parameter.most:
            raise ValueError(f"{name} must be from {parameter.least} to {parameter.most}, not {value}")
        if isinstance(parameter, Choice) and value not in [choice[0] for choice in parameter.choices]:
            raise ValueError(f"no {name} '{value}'")


def integrators():
    return list(INTEGRATORS)


def integrator_table():
    return [
        dict(
            name=each.name,
            label=each.label,
            description=each.description,
            parameters=dict(each.defaults),
            unbiased_parameters=dict(each.unbiased),
        )
        for each in INTEGRATORS.values()
    ]


def reservoir_bytes(settings):
    """64 bytes a pixel for every integrator with reservoirs."""
    _refuse_reuse(settings)
    return 64 * settings["width"] * settings["height"] if settings["integrator"] != "path" else 0


def devices():
    return [dict(name="Fake", driver="none", kind="cpu", api="1.3", memory=1 << 30, usable=True, why_not="")]


def install():
    """Puts this module in the place of the real core; before the add-on is imported. Returns it."""
    import headwater

    module = sys.modules[__name__]
    sys.modules["headwater._core"] = headwater._core = module
    return module

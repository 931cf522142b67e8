# SPDX-License-Identifier: Apache-2.0
"""A USD stage at a time as edits of a core scene. Only what differs from the last time is sent.

The scene is the core's `Scene` (docs/architecture.md) or anything with its methods. Prims are untrusted: what can't be
rendered is left out with one warning that names it, and the rest goes on.
"""

import time as clock
from dataclasses import dataclass, field

import numpy as np

from headwater.errors import first_line
from headwater.usd_scene import camera as cameras
from headwater.usd_scene import light as lights
from headwater.usd_scene.ids import path_id, random_id
from headwater.usd_scene.instances import expand_instancer
from headwater.usd_scene.lamps import LampSync
from headwater.usd_scene.material import Materials
from headwater.usd_scene.mesh import MeshError, ask_tangents, read_mesh
from headwater.usd_scene.report import Report
from headwater.usd_scene.shapes import is_shape, shape_mesh, shape_varies
from headwater.usd_scene.skinning import Skeletons
from headwater.usd_scene.stage import matrix_to_numpy, usd_messages

LIGHT_FLAGS = [f"HW_LIGHT_{name}" for name in ("CAST_SHADOW", "USE_MIS", "CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION")]
PURPOSES = ("default", "render")


@dataclass
class _KnownMesh:
    """A mesh that the scene has."""

    id: int
    varies: bool  # may change over time
    subsets: list = field(default_factory=list)  # paths of the subsets with a material, in slot order from 1
    has_color: bool = False  # has displayColor
    tangents: set = field(default_factory=set)  # names that materials of its instances asked for
    placed: np.ndarray | None = None  # skinned: the transform to stage space instead of the prim's own
    frame: object = None  # time it was last read at
    box: np.ndarray | None = None  # (2, 3) of its positions
    error: bool = False


class StageSync:
    """Keeps `scene` equal to an OpenStage, one time code after another."""

    def __init__(self, opened, scene, *, warn=None, flags):
        self.opened = opened
        self.scene = scene
        self.report = Report(warn)
        for text in opened.warnings:
            self.report.once(text, text)
        # UsdLux has no visibility to the camera: lights with a size are seen, as surfaces are.
        self._lamps = LampSync(scene, self.report, sum(flags[name] for name in LIGHT_FLAGS))
        self.materials = Materials(scene, self.report)
        self.skeletons = Skeletons(opened.stage)
        self._meshes = {}
        self._sent = {"instance": {}}  # id -> what was sent, to send only what differs
        self._camera = self._world = None

    def sync(self, frame: float, *, aspect: float, camera: str | None = None) -> float:
        """Makes the scene the stage at time code `frame`; returns the seconds it took.

        `aspect`: the picture's width over height; `camera`: a camera's path or name.
        """
        from pxr import Usd, UsdGeom, UsdUtils

        start = clock.perf_counter()
        diagnostics = UsdUtils.CoalescingDiagnosticDelegate()  # USD's own messages become ours
        self.time = Usd.TimeCode(frame)
        self.xforms = UsdGeom.XformCache(self.time)
        self._seen = {"instance": set()}
        self._lamps.begin()
        self._domes = []
        self._placed = []  # (box of a mesh, matrices), for a stage without a camera
        self._visible_prims()
        self._lamps.send()
        self._remove_unseen()
        self._set_world()
        self._set_camera(camera, aspect)
        for text in usd_messages(diagnostics):
            self.report.once(text, text)
        return clock.perf_counter() - start

    # Traversal

    def _visible(self, prim) -> bool:
        """Whether this prim itself (its parents aside) is seen in a final render."""
        from pxr import UsdGeom

        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return True
        if imageable.GetVisibilityAttr().Get(self.time) == UsdGeom.Tokens.invisible:
            return False
        purpose = imageable.GetPurposeAttr()
        return not purpose.HasAuthoredValue() or purpose.Get() in PURPOSES

    def _visible_prims(self):
        from pxr import Usd, UsdGeom, UsdLux

        prims = iter(Usd.PrimRange.Stage(self.opened.stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            if not self._visible(prim):
                prims.PruneChildren()
            elif prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                self._instancer(prim)
            elif prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1):
                self._domes.append(prim)
            elif prim.HasAPI(UsdLux.LightAPI) and not prim.IsA(UsdGeom.Gprim):
                self._light(prim)
            elif prim.IsA(UsdGeom.Gprim):
                self._geometry(prim)

    def _world_matrix(self, prim):
        return self.opened.to_world @ matrix_to_numpy(self.xforms.GetLocalToWorldTransform(prim))

    # Geometry

    def _geometry(self, prim):
        known, materials = self._mesh(prim)
        if known.error:
            return
        matrix = self._world_matrix(prim)
        if self.skeletons.binds(prim) and known.placed is not None:
            matrix = self.opened.to_world @ known.placed
        identifier = path_id(prim.GetPath(), "instance")
        self._send_instance(identifier, str(prim.GetPath()), known, matrix, materials)

    def _instancer(self, prim):
        base = self._world_matrix(prim)
        for copies in expand_instancer(prim, self.time, self.xforms, self._visible, self.report):
            known, materials = self._mesh(copies.prim)
            if known.error:
                continue
            matrices = np.ascontiguousarray((base @ copies.matrices)[:, :3], np.float32)
            identifier = path_id(copies.key, "copies")
            self._send_copies(identifier, copies.key, known, matrices, materials)

    def _mesh(self, prim) -> tuple[_KnownMesh, list]:
        """The scene's mesh for a geometry prim and the prim's materials; native instances share their prototype's.

        One whose materials ask for tangents that the mesh was not given has it sent again.
        """
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() and not self.skeletons.binds(prim) else prim
        path = source.GetPath()
        known = self._meshes.get(path)
        if known is None:
            known = self._meshes[path] = _KnownMesh(path_id(path, "mesh"), self._varies(source))
        elif not known.varies or known.frame == self.time:
            materials = [] if known.error else self._slot_materials(prim, known)
            if self.materials.tangents(materials) <= known.tangents:
                return known, materials
        known.frame = self.time
        known.placed = None
        try:
            materials = self._send_mesh(source, prim, known)
            known.error = False
        except (MeshError, ValueError) as error:
            materials, known.error = [], True
            self.report.warn(path, f"{first_line(error)}; it is left out")
        return known, materials

    def _varies(self, prim) -> bool:
        from pxr import UsdGeom

        if self.skeletons.binds(prim):
            return True
        if is_shape(prim):
            return shape_varies(prim)
        mesh = UsdGeom.Mesh(prim)
        if not mesh:
            return False
        attributes = [
            mesh.GetPointsAttr(),
            mesh.GetFaceVertexCountsAttr(),
            mesh.GetFaceVertexIndicesAttr(),
            mesh.GetNormalsAttr(),
        ]
        attributes += [p.GetAttr() for p in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues()]
        return any(attribute.ValueMightBeTimeVarying() for attribute in attributes)

    def _send_mesh(self, source, prim, known) -> list:
        """Sends the mesh; returns the prim's materials."""
        from pxr import UsdGeom

        subsets = []
        if is_shape(source):
            mesh = shape_mesh(source, self.time)
        elif source.IsA(UsdGeom.Mesh):
            points = None
            if self.skeletons.binds(prim):
                skinned = self.skeletons.deform(prim, self.time, self.xforms)
                points, known.placed = skinned.points, skinned.matrix
            subsets = self.materials.subsets(source)
            mesh = read_mesh(source, self.time, points, [faces for _, faces in subsets], self.report)
        else:
            raise MeshError(f"geometry of type {source.GetTypeName()} is not supported")
        known.box = np.stack([mesh.positions.min(axis=0), mesh.positions.max(axis=0)]).astype(float)
        known.subsets = [subset.GetPath() for subset, _ in subsets]
        known.has_color = any(name == "displayColor" for name, _, _ in mesh.attributes)
        materials = self._slot_materials(prim, known)
        known.tangents |= self.materials.tangents(materials)
        for name in ask_tangents(mesh, known.tangents):
            self.report.warn(source.GetPath(), f"no room for the tangents '{name}' beside its primvars")
        self.scene.upsert_mesh(
            known.id,
            str(source.GetPath()),
            mesh.positions,
            mesh.tri_vertices,
            tri_corners=mesh.tri_corners,
            normals=mesh.normals,
            tri_slots=mesh.tri_slots,
            attributes=mesh.attributes,
            tangents=mesh.tangents,
            default_uv=mesh.default_uv,
        )
        return materials

    def _slot_materials(self, prim, known) -> list:
        """Material ids of slot 0 (the mesh's own) and of each subset."""
        bound = [self.materials.bound(prim, known.has_color)]
        for path in known.subsets:
            subset = prim.GetChild(path.name)
            bound.append(self.materials.bound(subset, known.has_color) if subset else bound[0])
        return bound

    def _send_instance(self, identifier, name, known, matrix, materials):
        if not np.isfinite(matrix).all():
            self.report.warn(name, "its transform is not finite; it is left out")
            return
        matrix = np.ascontiguousarray(matrix[:3], np.float32)
        self._placed.append((known.box, matrix[None]))
        self._send(
            "instance",
            identifier,
            (known.id, matrix.tobytes(), tuple(materials), 1),
            lambda: self.scene.upsert_instance(
                identifier, known.id, matrix, name=name, materials=materials, random_id=random_id(name), moves=True
            ),
            name,
        )

    def _send_copies(self, identifier, name, known, matrices, materials):
        previous = self._sent["instance"].get(identifier)
        if previous is not None and previous[3] != len(matrices):
            self.scene.remove_instances(identifier, previous[3])
            del self._sent["instance"][identifier]
        self._placed.append((known.box, matrices))
        numbers = (np.arange(len(matrices), dtype=np.uint64) * 2654435761 + random_id(name)).astype(np.uint32)
        self._send(
            "instance",
            identifier,
            (known.id, hash(matrices.tobytes()), tuple(materials), len(matrices)),
            lambda: self.scene.upsert_instances(
                identifier, known.id, matrices, random_ids=numbers, name=name, materials=materials, moves=True
            ),
            name,
        )

    # Lights, world, camera

    def _light(self, prim):
        from pxr import UsdLux

        name = str(prim.GetPath())
        if prim.IsA(UsdLux.PortalLight):
            return  # a hint for sampling; it gives no light of its own
        matrix = self._world_matrix(prim)
        if prim.IsA(UsdLux.CylinderLight):
            self._tube(prim, matrix)
            return
        lamp = lights.lamp(prim, self.time, matrix, self.opened.meters_per_unit, self.report)
        if lamp is None:
            if not any(
                prim.IsA(k) for k in (UsdLux.SphereLight, UsdLux.DiskLight, UsdLux.RectLight, UsdLux.DistantLight)
            ):
                self.report.warn(name, f"lights of type {prim.GetTypeName()} are not supported; it is left out")
            return
        self._lamps.add(path_id(name, "light"), name, lamp)

    def _tube(self, prim, matrix):
        """A cylinder light, as an emissive mesh."""
        from pxr import UsdLux

        light = UsdLux.CylinderLight(prim)
        radiance = lights.tube_radiance(light, self.time, matrix, self.opened.meters_per_unit, self.report)
        positions, triangles = lights.tube(light, self.time)
        if not radiance.any() or not np.isfinite(positions).all():
            return
        box = np.stack([positions.min(axis=0), positions.max(axis=0)]).astype(float)
        known = _KnownMesh(path_id(prim.GetPath(), "mesh"), True, box=box)
        if self._sent.setdefault("tube", {}).get(known.id) != positions.tobytes():
            self.scene.upsert_mesh(known.id, str(prim.GetPath()), positions, triangles)
            self._sent["tube"][known.id] = positions.tobytes()
        material = self.materials.emission(str(prim.GetPath()), radiance)
        self._send_instance(path_id(prim.GetPath(), "instance"), str(prim.GetPath()), known, matrix, [material])

    def _set_world(self):
        world = self.materials.world(self._domes, self.time, self._world_matrix)
        if world != self._world:
            self.scene.set_world("world", world[0], material=world[1])
            self._world = world

    def _set_camera(self, name, aspect):
        prim = cameras.find_camera(self.opened.stage, name)
        if prim is None:
            arguments = cameras.frame_all_arguments(self._bounds(), aspect)
            self.report.once("camera", "the stage has no camera; one that sees everything is used")
        else:
            arguments = cameras.camera_arguments(prim, self.time, self.opened, aspect, self.report)
        kind, matrix, plane = (arguments.pop(key) for key in ("kind", "matrix", "plane"))
        self.scene.set_camera(kind, np.ascontiguousarray(matrix, np.float32), plane, **arguments)

    def _bounds(self):
        """(2, 3) box of all instances. Not by UsdGeom.BBoxCache: instancers that contain themselves crash it."""
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for box, matrices in self._placed:
            points = box[0] + corners * (box[1] - box[0])
            points = np.einsum("nij,kj->nki", matrices[:, :, :3], points) + matrices[:, None, :, 3]
            low, high = np.minimum(low, points.min(axis=(0, 1))), np.maximum(high, points.max(axis=(0, 1)))
        if not self._placed:
            return np.array([[-1.0, -1, -1], [1, 1, 1]])
        return np.stack([low, high])

    # Sending

    def _send(self, kind, identifier, content, action, name):
        """Runs `action` when `content` differs from what was sent last under this id."""
        self._seen[kind].add(identifier)
        if self._sent[kind].get(identifier) == content:
            return
        try:
            action()
        except ValueError as error:  # the core's SceneError
            self._seen[kind].discard(identifier)
            self.report.warn(name, f"{first_line(error)}; it is left out")
            return
        self._sent[kind][identifier] = content

    def _remove_unseen(self):
        for identifier in self._sent["instance"].keys() - self._seen["instance"]:
            count = self._sent["instance"].pop(identifier)[3]
            if count == 1:
                self.scene.remove_instance(identifier)
            else:
                self.scene.remove_instances(identifier, count)

# SPDX-License-Identifier: Apache-2.0
"""Material bindings of a stage as the core's materials: UsdPreviewSurface, display colours, emitters, domes.

UsdPreviewSurface itself is compiled by headwater/materials/preview_surface.py.
"""

import numpy as np

from headwater.errors import UserError, first_line
from headwater.materials import Graph, ProgramError, Surface, compile_background
from headwater.materials import opcodes as op
from headwater.materials.assembler import Closure
from headwater.usd_scene import light as lights
from headwater.usd_scene.ids import path_id
from headwater.usd_scene.images import Images
from headwater.usd_scene.mesh import TANGENT

DEFAULT = 0  # the core's own grey material


class Materials:
    """Keeps the core's materials that the stage's bindings need. Each is compiled once; textures are loaded once."""

    def __init__(self, scene, report):
        self._scene = scene
        self._report = report
        self._images = Images(scene, report)
        self._known = {}  # material path -> id
        self._display = None
        self._tangents = {}  # id -> names of tangents of UV maps that it reads, of materials that read some
        self._sent = {}  # id -> content, of materials that are set again

    def bound(self, prim, has_color: bool) -> int:
        """The id of the material that a mesh or a GeomSubset is bound to; display colour or grey without one."""
        from pxr import UsdShade

        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not material:
            return self._display_color() if has_color else DEFAULT
        path = material.GetPath()
        if path not in self._known:
            self._known[path] = self._compile(material)
        return self._known[path]

    def tangents(self, identifiers) -> set[str]:
        """Names of the tangents that materials read: that of a UV map (none: of the default one) and ".tangent"."""
        return set().union(*(self._tangents.get(identifier, ()) for identifier in identifiers))

    def subsets(self, prim) -> list:
        """(subset prim, face indices) of the mesh's material subsets that have faces."""
        from pxr import UsdGeom, UsdShade

        found = []
        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
                self._report.warn(subset.GetPath(), "only subsets of faces can have materials; it is left out")
                continue
            faces = np.array(subset.GetIndicesAttr().Get() or [], np.int64)
            if len(faces):
                found.append((subset.GetPrim(), faces))
        return found

    def _compile(self, material) -> int:
        path = material.GetPath()
        from headwater.materials.preview_surface import compile_preview_surface

        try:
            compiled = compile_preview_surface(material)
        except (UserError, ValueError, ProgramError) as error:
            self._report.warn(path, f"{first_line(error)}; it is shown grey")
            return DEFAULT
        for text in compiled.notes:
            self._report.warn(path, text)
        return self._send(path_id(path, "material"), str(path), compiled)

    def _send(self, identifier, name, compiled) -> int:
        images = [self._images.load(*image, name) for image in compiled.images]
        try:
            self._scene.upsert_material(
                identifier,
                name,
                compiled.program,
                compiled.constants,
                images=images,
                flags=compiled.flags,
                emission=compiled.emission,
            )
        except ValueError as error:
            self._report.warn(name, f"{first_line(error)}; it is shown grey")
            return DEFAULT
        tangents = {name for name in compiled.attributes if name.endswith(TANGENT)}
        if tangents:
            self._tangents[identifier] = tangents
        return identifier

    def _display_color(self) -> int:
        """A diffuse material of the mesh's displayColor."""
        if self._display is None:
            graph = Graph()
            surface = Surface(graph)
            color = graph.attribute("displayColor", op.ATTRIBUTE_VALUE)
            surface.add(Closure(op.OP_DIFFUSE, (color, graph.zero, graph.normal, None, graph.one)))
            compiled = surface.finish([], ["displayColor"], [])
            self._display = self._send(path_id("/", "displayColor"), "displayColor", compiled)
        return self._display

    def emission(self, name: str, radiance) -> int:
        """The id of a material that only emits `radiance` (3,)."""
        identifier = path_id(name, "emission")
        content = tuple(float(v) for v in radiance)
        if self._sent.get(identifier) != content:
            graph = Graph()
            surface = Surface(graph)
            surface.emit(graph.const(*content))
            self._send(identifier, name, surface.finish([], [], []))
            self._sent[identifier] = content
        return identifier

    def world(self, domes, time, world_matrix):
        """((r, g, b), material id) of the sum of the dome lights; the id is 0 for a constant background."""
        constant, textured = np.zeros(3), []
        for prim in domes:
            radiance = lights.radiance(prim, time, self._report)
            path = lights.dome_texture(prim, time, self._report)
            if path is None or not radiance.any():
                constant += radiance
                continue
            matrix = world_matrix(prim)
            if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
                self._report.warn(prim.GetPath(), "its transform is flat or not finite; it is left out")
                continue
            rows = np.concatenate([lights.dome_rotation(prim, matrix), np.zeros((3, 1))], axis=1)
            textured.append((self._images.load(path, "auto", prim.GetPath()), tuple(radiance), tuple(map(tuple, rows))))
        if not textured:
            return tuple(constant.tolist()), 0
        identifier = path_id("/", "world")
        content = (tuple(constant.tolist()), tuple(textured))
        if self._sent.get(identifier) != content:
            compiled = _background(constant, textured)
            self._scene.upsert_material(
                identifier,
                "world",
                compiled.program,
                compiled.constants,
                images=[image for image, _, _ in textured],
                flags=compiled.flags,
            )
            self._sent[identifier] = content
        return (0.0, 0.0, 0.0), identifier


def _background(constant, textured):
    """The program of constant radiance plus equirectangular images, each (id, radiance, rows (3, 4) of its turn)."""
    graph = Graph()
    total = graph.const(*constant)
    for index, (_, radiance, rows) in enumerate(textured):
        place = graph.make_varying(op.OP_ENVIRONMENT, graph.matrix(graph.position, rows), sub=0)
        kind = op.INTERPOLATION_LINEAR | op.EXTENSION_REPEAT << 2 | op.PROJECTION_FLAT << 4
        color = graph.make_varying(op.OP_IMAGE, place, graph.zero, sub=kind, imm=index)
        total = graph.add(total, graph.mul(color, graph.const(*radiance)))
    return compile_background(graph, total, [image for image, _, _ in textured], [])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's shader node trees → material programs.

compile_material, compile_world: a CompiledMaterial (headwater.materials), whose `images` are ImageRequests.
compile_lamp: the factor a lamp's node tree puts on its colour.
"""

import bpy
import numpy as np

from headwater.materials import CompiledMaterial, ProgramError, Surface, closures, compile_background
from headwater.materials import opcodes as op

from . import converter_nodes, input_nodes, shader_nodes, texture_nodes
from .tree import TreeCompiler

__all__ = ["compile_lamp", "compile_material", "compile_world"]

_HANDLERS = {**input_nodes.HANDLERS, **converter_nodes.HANDLERS, **texture_nodes.HANDLERS}
_ZONES = ("Repeat", "Closure", "Bundle", "Zone")


def _tree(block):
    """The node tree to compile, and something to hold meanwhile. Zones (Blender 5.0) are written out by Blender."""
    tree = block.node_tree if getattr(block, "use_nodes", True) else None
    inline = getattr(bpy.types, "InlineShaderNodes", None)
    if tree is None or inline is None or not _has_zones(tree):
        return tree, None
    make = {bpy.types.Material: "from_material", bpy.types.World: "from_world", bpy.types.Light: "from_light"}
    for kind, name in make.items():
        if isinstance(block, kind) and hasattr(inline, name):
            held = getattr(inline, name)(block)
            return held.node_tree, held
    return tree, None


def _has_zones(tree) -> bool:
    seen, stack = set(), [tree]
    while stack:
        current = stack.pop()
        if current.as_pointer() in seen:
            continue
        seen.add(current.as_pointer())
        for node in current.nodes:
            if any(part in node.bl_idname for part in _ZONES):
                return True
            if getattr(node, "node_tree", None) is not None:
                stack.append(node.node_tree)
    return False


def _output(tree, kind: str):
    """The active output node for Cycles, or for all engines."""
    if hasattr(tree, "get_output_node") and kind == "ShaderNodeOutputMaterial":
        node = tree.get_output_node("CYCLES")
        if node is not None:
            return node
    found = [n for n in tree.nodes if n.bl_idname == kind and getattr(n, "target", "ALL") in ("ALL", "CYCLES")]
    active = [n for n in found if n.is_active_output]
    return (active or found or [None])[0]


def _setting(block, name: str, default):
    """A setting of Cycles that may live in its add-on's group, in the data-block, or (without Cycles) in ours."""
    for owner in (getattr(block, "cycles", None), block, getattr(block, "headwater", None)):
        value = getattr(owner, name, None)
        if value is not None:
            return value
    return default


def _material_flags(material) -> int:
    sampling = _setting(material, "emission_sampling", "AUTO")
    known = {"NONE": op.MATERIAL_NO_MIS, "FRONT": op.MATERIAL_EMIT_FRONT, "BACK": op.MATERIAL_EMIT_BACK}
    flags = known.get(sampling, 0)
    return flags | (op.MATERIAL_BUMP_CORRECTION if _setting(material, "use_bump_map_correction", True) else 0)


def compile_material(material) -> CompiledMaterial:
    """Compiles a bpy Material. Never fails: what can't be compiled is replaced and listed in `unsupported`."""
    flags = _material_flags(material)
    compiler = TreeCompiler(material.name, _HANDLERS, on_surface=True)
    surface = Surface(compiler.graph)
    tree, held = _tree(material)
    if tree is None:
        color = compiler.graph.const(*material.diffuse_color[:3])
        closures.add_diffuse(surface, compiler.graph.one, color, compiler.graph.zero, compiler.graph.normal)
    else:
        output = _output(tree, "ShaderNodeOutputMaterial")
        if output is not None:
            _displace(compiler, output, material)
            shader_nodes.add_shaders(compiler, surface, output.inputs["Surface"])
            if output.inputs["Volume"].is_linked:
                compiler.unsupported(output, "volumes are not supported")
    transparent = bool(_setting(material, "use_transparent_shadow", True))
    try:
        return surface.finish(
            compiler.images, compiler.attributes, compiler.problems, transparent_shadows=transparent, flags=flags
        )
    except ProgramError as error:
        return _too_large(compiler, str(error), flags)
    finally:
        del held


def _displace(compiler: TreeCompiler, output, material) -> None:
    """Displacement turns the normal, as Cycles' bump-only displacement does."""
    socket = output.inputs["Displacement"]
    if not socket.is_linked:
        return
    if _setting(material, "displacement_method", "BUMP") != "BUMP":
        compiler.unsupported(output, "displacement only turns the normal; the surface stays where it is")
    source = socket.links[0].from_node
    if source.bl_idname != "ShaderNodeDisplacement" or source.inputs["Normal"].is_linked:
        compiler.unsupported(output, "only the part of a displacement along the normal is used")
    g = compiler.graph
    width = g.const(0.1)
    heights = [g.dot(compiler.value(socket), g.normal)]
    heights += [g.dot(compiler.value_shifted(socket, shift, width), g.normal) for shift in (1, 2)]
    compiler.normal = input_nodes.bumped(g, heights, g.one, g.one, width, g.normal)


def _too_large(compiler: TreeCompiler, reason: str, flags: int) -> CompiledMaterial:
    """A grey surface for a tree that does not fit."""
    compiler.unsupported(None, f"the node tree is too large ({reason}); the surface is grey")
    plain = TreeCompiler(compiler.name, {})
    surface = Surface(plain.graph)
    closures.add_diffuse(surface, plain.graph.one, plain.graph.const(0.8), plain.graph.zero, plain.graph.normal)
    return surface.finish([], (), compiler.problems, flags=flags)


def compile_world(world) -> CompiledMaterial:
    """Compiles a bpy World. A constant background has no program and its radiance in `emission`."""
    compiler = TreeCompiler(world.name, _HANDLERS)
    surface = Surface(compiler.graph)
    tree, held = _tree(world)
    radiance = compiler.graph.const(*world.color)
    if tree is not None:
        output = _output(tree, "ShaderNodeOutputWorld")
        if output is not None:
            shader_nodes.add_shaders(compiler, surface, output.inputs["Surface"])
            if output.inputs["Volume"].is_linked:
                compiler.unsupported(output, "volumes are not supported")
        radiance = surface.emission
    try:
        return compile_background(compiler.graph, radiance, compiler.images, compiler.problems)
    except ProgramError as error:
        compiler.unsupported(None, f"the node tree is too large ({error}); the background is black")
        return compile_background(compiler.graph, compiler.graph.zero, [], compiler.problems)
    finally:
        del held


def compile_lamp(light, note=None) -> np.ndarray:
    """Factor (3,) on a lamp's colour: colour times strength of its Emission nodes, where they are constant.

    `note(problems, "Light")` is told what is left out.
    """
    compiler = TreeCompiler(light.name, _HANDLERS)
    tree, held = _tree(light)
    if tree is None:
        return np.ones(3, np.float32)
    surface = Surface(compiler.graph)
    output = _output(tree, "ShaderNodeOutputLight")
    if output is not None:
        shader_nodes.add_shaders(compiler, surface, output.inputs["Surface"])
    value = surface.emission.value
    if value is None:
        compiler.unsupported(output, "a lamp's emission that varies is not supported; its colour alone is used")
        value = (1.0, 1.0, 1.0)
    del held
    if note is not None:
        note(compiler.problems, "Light")
    return np.array(value, np.float32)

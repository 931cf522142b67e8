# SPDX-License-Identifier: Apache-2.0
"""Materials of the figure scenes: matte ones with or without a picture, plain Principled ones, pure emitters.

Kept to what needs little shading: the figures are about choosing lights, and have to be made on two cores.
"""

import bpy
import numpy as np
import textures


def _material(name, shader_type):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):  # always true since 5.0
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(shader_type)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material, tree, shader


def matte(name, colour=(0.8, 0.8, 0.8), picture=None):
    """A Lambertian surface of a linear RGB albedo or of a picture's colours."""
    material, tree, shader = _material(name, "ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*colour, 1)
    if picture:
        read = tree.nodes.new("ShaderNodeTexImage")
        read.image = picture
        tree.links.new(read.outputs["Color"], shader.inputs["Color"])
    return material


def glossy(name, colour, roughness=0.4):
    """A dielectric: Principled with a linear RGB base colour."""
    material, _, shader = _material(name, "ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    return material


def glow(name, strength, colour):
    """A pure emitter of radiance strength · colour, W·sr⁻¹·m⁻²."""
    material, _, shader = _material(name, "ShaderNodeEmission")
    shader.inputs["Color"].default_value = (*colour, 1)
    shader.inputs["Strength"].default_value = strength
    return material


def slabs(name, light, dark, rows, columns, seed):
    """A picture of worn stone slabs in running bond, between two sRGB colours."""
    height, own = textures.bricks((512, 512), rows, columns, seed, mortar=0.06)
    wear = textures.noise((512, 512), (6, 6), seed + 1)
    tone = np.clip(0.25 + 0.5 * own + 0.5 * (wear - 0.5), 0, 1) * (0.35 + 0.65 * np.clip(height * 1.5, 0, 1))
    return textures.image(name, textures.mix(np.array(dark), np.array(light), tone))

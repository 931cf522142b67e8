# SPDX-License-Identifier: Apache-2.0
"""What moves in an animation of a benchmark scene: the camera, a part of the lights, or both. One speed each, so that
any two frames that follow one another differ by as much."""

import math

import numpy as np
from mathutils import Vector

FRAMES = 48
WALK = 1.4  # of the camera [m/s]
TURN = math.radians(10)  # of the camera [1/s]
DRIFT = 0.8  # of lights, at most [m/s]
STILL = 9  # of ten lights


def animate(scene, what: str, seed: int) -> None:
    """what: "camera" walks ahead and turns a little; "lights": every tenth drifts off; "both"."""
    scene.frame_end = FRAMES
    if what in ("camera", "both"):
        _walk(scene)
    if what in ("lights", "both"):
        _drift(scene, seed)


def linear(mover) -> None:
    """Makes it move at one speed, before the first key and after the last one too."""
    action = mover.animation_data.action
    if hasattr(action, "layers") and len(action.layers):  # Blender 4.4
        curves = action.layers[0].strips[0].channelbag(mover.animation_data.action_slot).fcurves
    else:
        curves = action.fcurves
    for curve in curves:
        curve.extrapolation = "LINEAR"
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def _key(scene, thing, velocity, turn=(0.0, 0.0, 0.0)) -> None:
    """velocity [m/s] and turn [1/s] from frame 1 on."""
    place, angles = np.array(thing.location), np.array(thing.rotation_euler)
    for frame in (1, FRAMES):
        seconds = (frame - 1) / scene.render.fps
        thing.location = place + seconds * np.asarray(velocity)
        thing.rotation_euler = angles + seconds * np.asarray(turn)
        thing.keyframe_insert("location", frame=frame)
        thing.keyframe_insert("rotation_euler", frame=frame)
    linear(thing)


def _walk(scene) -> None:
    ahead = scene.camera.rotation_euler.to_matrix() @ Vector((0.0, 0.0, -1.0))
    level = np.array((ahead[0], ahead[1], 0.0))
    _key(scene, scene.camera, WALK * level / max(np.linalg.norm(level), 1e-6), (0.0, 0.0, TURN))


def _drift(scene, seed: int) -> None:
    """Lamps and glowing meshes, but not those that are places or parts of instances."""
    rng = np.random.default_rng([seed, 77])
    found = [
        o for o in scene.objects if not o.parent and o.instance_type == "NONE" and (o.type == "LIGHT" or _glows(o))
    ]
    if not found:
        raise ValueError(
            "no light of its own could move: above 10,000 they are instances, and skies stay where they are"
        )
    for light in found[:: STILL + 1]:
        angle = rng.uniform(0, 2 * math.pi)
        speed = rng.uniform(0.3, 1.0) * DRIFT
        _key(scene, light, (speed * math.cos(angle), speed * math.sin(angle), 0.0))


def _glows(thing) -> bool:
    if thing.type != "MESH":
        return False
    trees = [m.node_tree for m in thing.data.materials if m and m.node_tree]
    sockets = [node.inputs.get("Emission Strength") for tree in trees for node in tree.nodes]
    emitters = any(node.bl_idname == "ShaderNodeEmission" for tree in trees for node in tree.nodes)
    return emitters or any(s is not None and s.default_value > 0 for s in sockets)

# SPDX-License-Identifier: Apache-2.0
"""What moves by itself in the night market: walkers on skinned skeletons, a paper carp, banners in the wind."""

import math

import bpy
import numpy as np
from shapes import Shape, place

# Bones of a person 1.75 m tall facing +Y: name -> (head, tail, parent).
BONES = {
    "hips": ((0, 0, 0.92), (0, 0, 1.08), None),
    "chest": ((0, 0, 1.08), (0, 0, 1.46), "hips"),
    "head": ((0, 0, 1.46), (0, 0, 1.75), "chest"),
    "thigh.L": ((-0.10, 0, 0.92), (-0.10, 0.01, 0.50), "hips"),
    "shin.L": ((-0.10, 0.01, 0.50), (-0.10, 0, 0.06), "thigh.L"),
    "thigh.R": ((0.10, 0, 0.92), (0.10, 0.01, 0.50), "hips"),
    "shin.R": ((0.10, 0.01, 0.50), (0.10, 0, 0.06), "thigh.R"),
    "arm.L": ((-0.21, 0, 1.40), (-0.25, 0, 1.12), "chest"),
    "hand.L": ((-0.25, 0, 1.12), (-0.26, 0.03, 0.84), "arm.L"),
    "arm.R": ((0.21, 0, 1.40), (0.25, 0, 1.12), "chest"),
    "hand.R": ((0.25, 0, 1.12), (0.26, 0.03, 0.84), "arm.R"),
}


def _skeleton(name, bones, collection, location, turn):
    data = bpy.data.armatures.new(name)
    rig = place(name, data, collection, location, (0, 0, turn))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone, (head, tail, parent) in bones.items():
        edit = data.edit_bones.new(bone)
        edit.head, edit.tail = head, tail
        if parent:
            edit.parent = data.edit_bones[parent]
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def _skin(name, mesh, rig, weights, collection):
    """weights: bone -> (V,) array; the mesh follows the rig through an Armature modifier."""
    body = place(name, mesh, collection)
    body.parent = rig
    for bone, values in weights.items():
        group = body.vertex_groups.new(name=bone)
        for index in np.flatnonzero(values > 1e-3):
            group.add([int(index)], float(values[index]), "REPLACE")
    body.modifiers.new("Skeleton", "ARMATURE").object = rig
    return body


def _person_shape(hat):
    shape = Shape()
    coat = [
        (0.19, 0.62),
        (0.20, 0.78),
        (0.165, 0.98),
        (0.17, 1.15),
        (0.205, 1.32),
        (0.19, 1.42),
        (0.09, 1.49),
        (0.06, 1.52),
    ]
    shape.lathe(coat, 20, slot=0, group="torso", squash=(1.0, 0.72))
    shape.lathe([(0.001, 1.44), (0.075, 1.46), (0.065, 1.53)], 14, slot=3, group="torso")
    head = [
        (max(0.102 * math.cos(a), 1e-3), 1.63 + 0.125 * math.sin(a)) for a in np.linspace(-math.pi / 2, math.pi / 2, 10)
    ]
    shape.lathe(head, 16, slot=1, group="head", squash=(0.88, 1.0))
    hair = [(max(0.112 * math.cos(a), 1e-3), 1.645 + 0.132 * math.sin(a)) for a in np.linspace(-0.35, math.pi / 2, 8)]
    shape.lathe(hair, 16, (0, -0.018, 0), 2, "head", (0.92, 1.0))
    if hat:
        shape.lathe([(0.30, 1.655), (0.16, 1.735), (0.001, 1.85)], 24, slot=4, group="head")
    for side, x in (("L", -1), ("R", 1)):
        leg = [
            (x * 0.10, 0, 0.95),
            (x * 0.10, 0.006, 0.72),
            (x * 0.10, 0.01, 0.52),
            (x * 0.10, 0.005, 0.3),
            (x * 0.10, 0, 0.07),
        ]
        shape.tube(leg, np.array([0.095, 0.085, 0.068, 0.062, 0.052]), 10, 2, f"leg.{side}")
        shape.box((x * 0.10, 0.055, 0.045), (0.095, 0.26, 0.09), 2, f"foot.{side}")
        arm = [
            (x * 0.195, 0, 1.42),
            (x * 0.23, 0, 1.28),
            (x * 0.25, 0, 1.12),
            (x * 0.257, 0.015, 0.98),
            (x * 0.26, 0.03, 0.86),
        ]
        shape.tube(arm, np.array([0.062, 0.058, 0.052, 0.047, 0.045]), 9, 0, f"arm.{side}")
        shape.lathe(
            [(0.001, -0.06), (0.035, -0.03), (0.038, 0.01), (0.001, 0.05)],
            8,
            (x * 0.26, 0.035, 0.83),
            1,
            f"hand.{side}",
        )
    return shape


def _person_weights(shape):
    z = np.array(shape.vertices)[:, 2]
    label = np.array(shape.groups)
    weights = {bone: np.zeros(len(z)) for bone in BONES}

    def ramp(low, high):
        t = np.clip((z - low) / (high - low), 0, 1)
        return t * t * (3 - 2 * t)

    torso = label == "torso"
    weights["chest"][torso] = ramp(0.98, 1.18)[torso]
    weights["hips"][torso] = 1 - ramp(0.98, 1.18)[torso]
    weights["head"][label == "head"] = 1
    for side in "LR":
        leg, arm = label == f"leg.{side}", label == f"arm.{side}"
        weights[f"thigh.{side}"][leg] = ramp(0.44, 0.58)[leg]
        weights[f"shin.{side}"][leg] = 1 - ramp(0.44, 0.58)[leg]
        weights[f"shin.{side}"][label == f"foot.{side}"] = 1
        weights[f"arm.{side}"][arm] = ramp(1.05, 1.19)[arm]
        weights[f"hand.{side}"][arm] = 1 - ramp(1.05, 1.19)[arm]
        weights[f"hand.{side}"][label == f"hand.{side}"] = 1
    return weights


def _bend(rig, bone, angle, frame):
    """Turns a bone about the person's own X axis (forward swing positive), whatever the bone's roll, and keys it."""
    pose = rig.pose.bones[bone]
    axis = pose.bone.matrix_local.to_3x3().inverted() @ __import__("mathutils").Vector((1, 0, 0))
    pose.rotation_mode = "AXIS_ANGLE"
    pose.rotation_axis_angle = (angle, *axis)
    pose.keyframe_insert("rotation_axis_angle", frame=frame)


def _walk(rig, phase, frames, holds, speed, period=26):
    """Keys a walk: thighs, knees, arms, the body's rise, and the way along the person's own +Y at speed m/s."""
    start = np.array(rig.location)
    heading = rig.rotation_euler.z
    for frame in range(1, frames + 3, 3):
        turn = 2 * math.pi * frame / period + phase
        for side, shift in (("L", 0.0), ("R", math.pi)):
            _bend(rig, f"thigh.{side}", 0.42 * math.sin(turn + shift), frame)
            _bend(rig, f"shin.{side}", -0.5 * max(0.0, math.cos(turn + shift)) - 0.1, frame)
            if side == "R" and holds:
                _bend(rig, "arm.R", 0.35, frame)
                _bend(rig, "hand.R", 1.75, frame)
            else:
                _bend(rig, f"arm.{side}", -0.36 * math.sin(turn + shift), frame)
                _bend(rig, f"hand.{side}", 0.22, frame)
        gone = speed * (frame - 1) / 24
        rise = 0.025 * math.cos(2 * turn)
        rig.location = start + np.array([-math.sin(heading) * gone, math.cos(heading) * gone, rise])
        rig.keyframe_insert("location", frame=frame)


def _umbrella(m):
    shape = Shape()
    radius, ribs = 0.66, 20
    angles = np.linspace(0, 2 * math.pi, ribs + 1)
    rows = []
    for r, z in ((0.02, 0.26), (0.3, 0.2), (0.55, 0.09), (1.0, -0.08)):
        dip = 0.03 * r * (np.arange(ribs + 1) % 2)
        rows.append(
            np.column_stack([np.cos(angles) * r * radius, np.sin(angles) * r * radius, np.full(ribs + 1, z) - dip])
        )
    shape.sheet(np.array(rows[::-1]), 0, smooth=False)
    for angle in angles[:-1:2]:
        shape.tube([(0, 0, 0.24), (np.cos(angle) * radius, np.sin(angle) * radius, -0.085)], 0.006, 4, 1)
    shape.tube([(0, 0, 0.32), (0, 0, -0.75)], 0.012, 7, 1)
    return shape.mesh("Umbrella", [m["umbrella"], m["dark wood"]])


def people(m, scene, frames, rng):
    """Walkers away from and towards the camera, one under a red umbrella, and sellers behind their counters."""
    umbrella = _umbrella(m)
    cast = [  # x, y, heading, coat, hat, umbrella, speed
        (0.30, -4.6, 0.05, "rust", False, True, 0.95),
        (-1.15, 1.2, -0.04, "sand", True, False, 0.9),
        (1.25, 4.4, math.pi - 0.05, "navy", False, False, 1.0),
        (-0.55, 7.6, math.pi, "rust", False, False, 1.1),
        (0.75, 11.5, 0.0, "charcoal", False, True, 0.9),
        (-1.3, 14.5, math.pi, "navy", True, False, 0.8),
        (0.3, 19.0, 0.0, "sand", False, False, 1.0),
    ]
    for index, (x, y, heading, coat, hat, holds, speed) in enumerate(cast):
        rig = _person(m, scene, f"Walker {index}", (x, y, 0.05), heading, coat, hat)
        _walk(rig, rng.uniform(0, 6), frames, holds, speed)
        if holds:
            held = place("Umbrella", umbrella, scene, (0.16, 0.20, 1.86), (-0.12, 0.10, 0))
            held.parent = rig
    return len(cast)


def _person(m, scene, name, location, heading, coat, hat):
    shape = _person_shape(hat)
    mesh = shape.mesh(name, [m[f"coat {coat}"], m["skin"], m["coat charcoal"], m["cloth red"], m["boards"]])
    rig = _skeleton(name, BONES, scene, location, heading)
    _skin(f"{name} body", mesh, rig, _person_weights(shape), scene)
    return rig


def sellers(m, scene, stalls, rng):
    """A still person behind every other counter."""
    coats = ["charcoal", "navy", "rust", "sand"]
    bodies = []
    for coat in coats:
        shape = _person_shape(coat in ("rust", "sand"))
        bodies.append(
            shape.mesh(
                f"Seller {coat}", [m[f"coat {coat}"], m["skin"], m["coat charcoal"], m["cloth red"], m["boards"]]
            )
        )
    for index, stall in enumerate(stalls):
        if index % 2 == 0:
            body = place(
                "Seller",
                bodies[index % 4],
                scene,
                (-1.12, rng.uniform(-0.6, 0.6), 0),
                (0, 0, -math.pi / 2 + rng.normal(0, 0.3)),
            )
            body.parent = stall


def carp(m, scene, frames, location=(1.7, -0.6, 3.75), length=3.6, turn=1.15):
    """A glowing paper carp over the street: a body, fins and tail skinned to a chain of seven bones that swims."""
    count = 7
    ys = np.linspace(0, -length, count + 1)
    names = [f"spine {i}" for i in range(count)]
    bones = {n: ((0, ys[i], 0), (0, ys[i + 1], 0), names[i - 1] if i else None) for i, n in enumerate(names)}
    rig = _skeleton("Carp", bones, scene, location, turn)
    shape = Shape()
    along = np.linspace(0, 1, 22)
    radius = 0.40 * np.sin(np.pi * np.clip(along * 0.86 + 0.10, 0, 1)) ** 0.75 + 0.03
    angles = np.linspace(0, 2 * math.pi, 19)
    ring = np.stack([np.cos(angles) * 0.78, 0 * angles, np.sin(angles)], axis=1)
    points = ring[None] * radius[:, None, None]
    points[..., 1] = (-along * length * 0.84)[:, None]
    shape.sheet(points[:, ::-1], 0, uv_size=(1.0, 1.0))
    fan = np.linspace(-1, 1, 9)
    tail = [
        np.column_stack(
            [0.02 * fan, np.full(9, -length * (0.82 + 0.18 * t)) + 0.10 * np.abs(fan) * -t, fan * (0.07 + 0.46 * t)]
        )
        for t in (0, 0.35, 0.7, 1.0)
    ]
    shape.sheet(np.array(tail), 0, uv_size=(0.3, 0.3))
    back = np.linspace(0.18, 0.6, 9)
    top = np.interp(back, along, radius)
    fin = [
        np.column_stack([0 * back, -back * length * 0.84 - 0.1 * k, top * 0.97 + k * 0.32 * np.sin((back - 0.14) * 6)])
        for k in (0, 0.5, 1)
    ]
    shape.sheet(np.array(fin), 0, uv_size=(0.4, 0.2))
    for side in (-1, 1):
        wing = [
            np.column_stack(
                [
                    side * (0.28 + 0.34 * k) * np.ones(5),
                    -length * np.linspace(0.2, 0.34, 5) - 0.25 * k,
                    -0.12 - 0.14 * k * np.ones(5),
                ]
            )
            for k in (0, 0.5, 1)
        ]
        shape.sheet(np.array(wing), 0, uv_size=(0.3, 0.3))
        eye = [(max(0.07 * math.cos(a), 1e-3), 0.07 * math.sin(a)) for a in np.linspace(-math.pi / 2, math.pi / 2, 7)]
        shape.lathe(eye, 10, (side * 0.215, -length * 0.075, 0.12), 1)
    where = np.clip(-np.array(shape.vertices)[:, 1] / length * count - 0.5, 0, count - 1)
    weights = {n: np.clip(1 - np.abs(where - i), 0, 1) for i, n in enumerate(names)}
    _skin("Carp body", shape.mesh("Carp", [m["fish"], m["dark wood"]]), rig, weights, scene)
    base = np.array(location, float)
    for frame in range(1, frames + 3, 3):
        t = 2 * math.pi * frame / 44
        for i, name in enumerate(names):
            pose = rig.pose.bones[name]
            pose.rotation_mode = "XYZ"
            pose.rotation_euler = (0.05 * math.sin(t - 0.6 * i), 0, (0.05 + 0.035 * i) * math.sin(t - 0.75 * i))
            pose.keyframe_insert("rotation_euler", frame=frame)
        gone = 0.9 * (frame - 1) / 24
        rig.location = base + np.array([-math.sin(turn) * gone, math.cos(turn) * gone, 0.06 * math.sin(t)])
        rig.keyframe_insert("location", frame=frame)
    return 1


def banners(m, scene, frames, rng):
    """Cloth banners on poles over the stalls, rippled by two shape keys a quarter of a wave apart."""
    names = ("red", "indigo", "ochre", "teal", "plum")
    rows, columns = 15, 8
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    for index, (side, y) in enumerate(((-1, -3.0), (1, 0.4), (-1, 4.1), (1, 7.6), (-1, 11.2), (1, 14.8))):
        rest = np.stack([u * 0.62, 0 * u, -1.75 * v], axis=2)
        shape = Shape().sheet(rest, 0)
        shape.tube([(-0.05, 0, 0.02), (0.67, 0, 0.02)], 0.014, 6, 1)
        mesh = shape.mesh("Banner", [m[f"awning {names[index % 5]}"], m["iron"]])
        banner = place(
            "Banner", mesh, scene, (side * 2.7 - (0.62 if side > 0 else 0.0), y, 4.35 + rng.uniform(-0.2, 0.3))
        )
        banner.shape_key_add(name="Basis")
        flat = np.array(shape.vertices)
        for key_name, shift in (("Ripple A", 0.0), ("Ripple B", math.pi / 2)):
            key = banner.shape_key_add(name=key_name)
            moved = flat.copy()
            cloth = slice(0, rows * columns)
            hang = np.clip(-flat[cloth, 2] / 1.75, 0, 1)
            wave = np.sin(flat[cloth, 2] * 5.2 + flat[cloth, 0] * 3.0 + shift)
            moved[cloth, 1] += 0.17 * hang * wave
            moved[cloth, 0] += 0.04 * hang * wave
            key.data.foreach_set("co", moved.astype(np.float32).ravel())
            key.slider_min = -1.0
            for frame in range(1, frames + 4, 4):
                key.value = math.cos(2 * math.pi * frame / 32 + index - shift)
                key.keyframe_insert("value", frame=frame)

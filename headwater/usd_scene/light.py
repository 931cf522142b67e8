# SPDX-License-Identifier: Apache-2.0
"""UsdLux lights to the core's lamps. UsdLux gives radiance; the core takes Blender's power, so each kind is converted.

Blender's power P for radiance L: sphere P = 4 π² r² L, rectangle and ellipse P = π A L, and a sun's strength is its
irradiance (core/lights/lamp.cpp has the other direction). UsdLux's `normalize` divides L by the light's area in stage
units, for distant lights by π sin²(angle / 2).
"""

import math
from dataclasses import dataclass

import numpy as np


@dataclass
class Lamp:
    """Arguments of the core's upsert_light."""

    kind: str
    matrix: np.ndarray  # (3, 4) metres, Z up
    color: tuple
    power: float
    options: dict


def radiance(prim, time, report):
    """The light's radiance (3,) before `normalize`: intensity × 2^exposure × colour × temperature."""
    from pxr import UsdLux

    light = UsdLux.LightAPI(prim)
    value = float(_get(light.GetIntensityAttr(), time, 1.0)) * 2.0 ** min(
        float(_get(light.GetExposureAttr(), time, 0.0)), 1000
    )
    colour = np.array(_get(light.GetColorAttr(), time, (1, 1, 1)), float) * value
    if _get(light.GetEnableColorTemperatureAttr(), time, False):
        kelvin = float(_get(light.GetColorTemperatureAttr(), time, 6500.0))
        if math.isfinite(kelvin) and kelvin > 0:
            colour *= np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin), float)
    if not np.isfinite(colour).all():
        report.warn(prim.GetPath(), "its intensity or colour is not finite; it is left dark")
        return np.zeros(3)
    if (colour < 0).any():
        report.warn(prim.GetPath(), "it has negative light, which is taken as none")
    for name, attribute in (("diffuse", light.GetDiffuseAttr()), ("specular", light.GetSpecularAttr())):
        factor = float(_get(attribute, time, 1.0))
        if factor != 1:
            report.warn(prim.GetPath(), f"its {name} multiplier {factor:g} is not supported and taken as 1")
    return np.maximum(colour, 0)


def _get(attribute, time, fallback):
    value = attribute.Get(time) if attribute else None
    return fallback if value is None else value


def lamp(prim, time, world, metres, report):
    """The Lamp of a sphere, disk, rect or distant light at `time`; None for dark lights and kinds that are no lamps.

    `world`: (4, 4) prim to metres, Z up, column vectors; `metres`: the stage's metersPerUnit.
    """
    from pxr import UsdLux

    if not np.isfinite(world).all():
        report.warn(prim.GetPath(), "its transform is not finite; it is left out")
        return None
    light = radiance(prim, time, report)
    if not light.any():
        return None
    normalize = bool(_get(UsdLux.LightAPI(prim).GetNormalizeAttr(), time, False))
    scale = np.linalg.norm(world[:3, :3], axis=0)
    for kind, build in (
        (UsdLux.SphereLight, _sphere),
        (UsdLux.DiskLight, _disk),
        (UsdLux.RectLight, _rect),
        (UsdLux.DistantLight, _distant),
    ):
        if prim.IsA(kind):
            built = build(kind(prim), time, scale, normalize, report)
            break
    else:
        return None
    if built is None:
        return None
    kind, factor, options = built
    _shape(prim, time, kind, options, report)
    kind = options.pop("kind", kind)
    light = light * factor
    if normalize and kind != "sun":
        light = light * metres**2  # `normalize` means an area in stage units
    power = float(light.max())
    # Lengths are in the options already, in metres; the matrix only turns and places. Area lamps keep shear out too.
    matrix = _without_scale(world, prim, report)
    if matrix is None:
        return None
    return Lamp(kind, matrix[:3], tuple((light / power).tolist()) if power > 0 else (0, 0, 0), power, options)


def _without_scale(world, prim, report):
    """`world` with unit columns; z stays the axis of the light, x and y are made perpendicular."""
    columns = world[:3, :3].copy()
    z, x = columns[:, 2], columns[:, 0]
    if not (np.linalg.norm(z) > 0 and np.linalg.norm(x) > 0):
        report.warn(prim.GetPath(), "its transform is flat; it is left out")
        return None
    # A flat light's plane is spanned by x and y: its normal, not the image of z, is where it shines.
    normal = np.cross(columns[:, 0], columns[:, 1])
    z = normal * np.sign(normal @ z) if np.linalg.norm(normal) > 0 else z
    z = z / np.linalg.norm(z)
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    result = np.eye(4)
    result[:3, 0], result[:3, 1], result[:3, 2], result[:3, 3] = x, np.cross(z, x), z, world[:3, 3]
    return result


def _size(prim, attribute, time, fallback, report, what):
    value = float(_get(attribute, time, fallback))
    if not (math.isfinite(value) and value >= 0):
        report.warn(prim.GetPath(), f"its {what} {value} is no length; it is left out")
        return None
    return value


def _sphere(light, time, scale, normalize, report):
    prim = light.GetPrim()
    radius = _size(prim, light.GetRadiusAttr(), time, 0.5, report, "radius")
    if radius is None:
        return None
    if scale.max() > scale.min() * 1.001:
        report.warn(prim.GetPath(), "its scale is not uniform; a sphere of the mean size is used")
    world_radius = radius * float(np.cbrt(scale.prod()))
    if radius == 0:
        if not normalize:
            report.warn(prim.GetPath(), "its radius is 0 without normalize, so it gives no light")
            return None
        factor = math.pi  # L / (4 π r²) over a sphere's disk π r² is an intensity of L / 4, of a lamp of π L watts
    else:
        factor = 4 * math.pi**2 * world_radius**2 / (4 * math.pi * world_radius**2 if normalize else 1)
    point = bool(_get(light.GetTreatAsPointAttr(), time, False))
    return "point", factor, {"radius": 0.0 if point else world_radius}


def _disk(light, time, scale, normalize, report):
    radius = _size(light.GetPrim(), light.GetRadiusAttr(), time, 0.5, report, "radius")
    if radius is None:
        return None
    width, height = 2 * radius * scale[0], 2 * radius * scale[1]
    return _flat(light.GetPrim(), width, height, math.pi / 4 * width * height, True, normalize, report)


def _rect(light, time, scale, normalize, report):
    prim = light.GetPrim()
    width = _size(prim, light.GetWidthAttr(), time, 1.0, report, "width")
    height = _size(prim, light.GetHeightAttr(), time, 1.0, report, "height")
    if width is None or height is None:
        return None
    if _get(light.GetTextureFileAttr(), time, None):
        report.warn(prim.GetPath(), "its texture is not supported; its colour is used")
    width, height = width * scale[0], height * scale[1]
    return _flat(prim, width, height, width * height, False, normalize, report)


def _flat(prim, width, height, area, ellipse, normalize, report):
    if not area > 0:
        report.warn(prim.GetPath(), "its area is zero; it is left out")
        return None
    return (
        "area",
        math.pi if normalize else math.pi * area,
        {"size_x": float(width), "size_y": float(height), "ellipse": ellipse},
    )


def _distant(light, time, _scale, normalize, report):
    angle = math.radians(float(_get(light.GetAngleAttr(), time, 0.53)))
    if not (math.isfinite(angle) and angle >= 0):
        report.warn(light.GetPath(), "its angle is no angle; 0 is used")
        angle = 0.0
    angle = min(angle, math.pi)
    solid = math.pi * math.sin(angle / 2) ** 2
    return "sun", 1.0 if normalize or angle == 0 else solid, {"angle": angle}


def _shape(prim, time, kind, options, report):
    """UsdLuxShapingAPI: a cone makes a sphere light a spot; the rest of it is not supported."""
    from pxr import UsdLux

    if not prim.HasAPI(UsdLux.ShapingAPI):
        return
    shaping = UsdLux.ShapingAPI(prim)
    angle = float(_get(shaping.GetShapingConeAngleAttr(), time, 90.0))
    softness = float(_get(shaping.GetShapingConeSoftnessAttr(), time, 0.0))
    if angle < 90 and kind == "point" and angle > 0:
        blend = min(max(softness, 0.0), 1.0) if math.isfinite(softness) else 0.0
        options.update(kind="spot", spot_size=2 * math.radians(angle), spot_blend=blend)
    elif angle < 90:
        report.warn(prim.GetPath(), f"a shaping cone on a light of kind '{kind}' is not supported and left out")
    if _get(shaping.GetShapingFocusAttr(), time, 0.0):
        report.warn(prim.GetPath(), "shaping:focus is not supported and left out")
    if _get(shaping.GetShapingIesFileAttr(), time, None):
        report.warn(prim.GetPath(), "IES profiles are not supported and left out")


def tube(light, time, steps: int = 48):
    """Positions (2 steps, 3) and triangles (2 steps, 3) of a cylinder light in its own space, along x, without caps."""
    radius = float(_get(light.GetRadiusAttr(), time, 0.5))
    length = float(_get(light.GetLengthAttr(), time, 1.0))
    angles = np.arange(steps) * 2 * math.pi / steps
    # Circumscribed and inscribed polygons err to either side: this radius gives the tube's true area.
    corrected = radius * (math.pi / steps) / math.sin(math.pi / steps)
    ring = np.stack([np.zeros(steps), np.cos(angles) * corrected, np.sin(angles) * corrected], axis=1)
    positions = np.concatenate([ring + [length / 2, 0, 0], ring - [length / 2, 0, 0]])
    i, j = np.arange(steps), (np.arange(steps) + 1) % steps
    triangles = np.concatenate([np.stack([i, j + steps, j], 1), np.stack([i, i + steps, j + steps], 1)])
    return positions.astype(np.float32), triangles.astype(np.uint32)


def tube_radiance(light, time, world, metres, report) -> np.ndarray:
    """Radiance (3,) of a cylinder light's surface."""
    value = radiance(light.GetPrim(), time, report)
    if not bool(_get(light.GetNormalizeAttr(), time, False)):
        return value
    scale = np.linalg.norm(world[:3, :3], axis=0)
    radius, length = float(_get(light.GetRadiusAttr(), time, 0.5)), float(_get(light.GetLengthAttr(), time, 1.0))
    area = 2 * math.pi * radius * math.sqrt(scale[1] * scale[2]) * length * scale[0]
    return value * metres**2 / area if area > 0 else np.zeros(3)


def dome_rotation(prim, world) -> np.ndarray:
    """(3, 3) from a world direction (Z up) to the axes of Blender's equirectangular look-up.

    A latlong texture of UsdLux has +y up, its centre at +z and +x a quarter to the left of it (as OpenEXR's latlong
    maps); Blender's has +z up, its centre at +x and +y a quarter to the left.
    """
    turn = pole_turn(prim) @ np.linalg.inv(world[:3, :3])
    turn = turn / np.cbrt(abs(np.linalg.det(turn)))
    cycle = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])
    return cycle @ turn


def pole_turn(prim) -> np.ndarray:
    """(3, 3) from the dome's space to the one whose pole is +y: DomeLight_1's poleAxis may put the pole on +z."""
    from pxr import UsdGeom

    attribute = prim.GetAttribute("poleAxis")
    axis = attribute.Get() if attribute else UsdGeom.Tokens.y
    if axis == "scene":
        axis = UsdGeom.GetStageUpAxis(prim.GetStage())
    return np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) if axis == UsdGeom.Tokens.z else np.eye(3)


def dome_texture(prim, time, report) -> str | None:
    """Resolved path of a dome light's texture ("" when it was not found), or None when it has none."""
    attribute = prim.GetAttribute("inputs:texture:file")
    asset = attribute.Get(time) if attribute else None
    if asset is None or not asset.path:
        return None
    layout = prim.GetAttribute("inputs:texture:format")
    layout = layout.Get(time) if layout else "automatic"
    if layout not in (None, "automatic", "latlong"):
        report.warn(prim.GetPath(), f"its texture's format '{layout}' is read as latlong")
    return asset.resolvedPath or ""

# SPDX-License-Identifier: GPL-3.0-or-later
"""Sky Texture: Preetham, Shirley and Smits 1999, "A practical analytic model for daylight", evaluated in the program.

Blender's Hosek-Wilkie and Nishita (single and multiple scattering) skies are approximated by it. A Hosek-Wilkie sky
has its own mean colour and lights the ground as it should (hosek_wilkie.py); how it is spread is Preetham's. Of
Nishita's the sun's place, a turbidity and the picture's exposure follow the node, its colours do not exactly: their
mean radiance over the sky was measured in Cycles 5.0.1's pictures, at three or four heights of the sun: the factors
below. The sun's disc is left out.
"""

import math

import numpy as np

from headwater.materials import opcodes as op

from .hosek_wilkie import mean_radiance

# Perez coefficients A .. E as turbidity * first + second, for luminance Y and chromaticities x, y.
_PEREZ = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
}
# Zenith chromaticity: rows of powers of turbidity (2, 1, 0), columns of powers of the sun's zenith angle (3 .. 0).
_ZENITH = {
    "x": (
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ),
    "y": (
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ),
}
_TO_RGB = (
    (3.2404542, -1.5371385, -0.4985314, 0),
    (-0.9692660, 1.8760108, 0.0415560, 0),
    (0.0556434, -0.2040259, 1.0572252, 0),
)
# Kilocandela to the node's unit: Blender's Preetham sky has 0.06 a kcd/m^2 (measured: Cycles 5.0.1's picture).
_UNIT = 0.06
_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
_STEEPEST = 3.0  # of a Hosek-Wilkie sky's factors, from the horizon to the zenith
_LOWEST = 0.01  # cosine to the zenith below which the sky stays as it is
_NISHITA = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}


def _zenith(turbidity: float, theta: float) -> dict:
    chi = (4.0 / 9.0 - turbidity / 120.0) * (math.pi - 2.0 * theta)
    zenith = {"Y": (4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192}
    for channel, rows in _ZENITH.items():
        powers = [sum(c * theta ** (3 - i) for i, c in enumerate(row)) for row in rows]
        zenith[channel] = powers[0] * turbidity**2 + powers[1] * turbidity + powers[2]
    return zenith


def _perez(c, theta: float, gamma: float) -> float:
    return (1.0 + c[0] * math.exp(c[1] / math.cos(theta))) * (
        1.0 + c[2] * math.exp(c[3] * gamma) + c[4] * math.cos(gamma) ** 2
    )


def _moments(coefficients, normalisation, theta_sun: float) -> np.ndarray:
    """Means of the sky that `sky` makes of these, times powers 0, 1, 2 of the cosine to the zenith, over the directions
    above the horizon, (3, 3): a row for each power."""
    cos_theta = (np.arange(32)[:, None] + 0.5) / 32
    azimuth = (np.arange(64) + 0.5) * (2.0 * math.pi / 64)
    cos_gamma = cos_theta * math.cos(theta_sun)
    cos_gamma = cos_gamma + np.sqrt(1.0 - cos_theta**2) * math.sin(theta_sun) * np.cos(azimuth)
    cos_gamma = np.clip(cos_gamma, -1.0, 1.0)
    luminance, x, y = (
        norm * (1.0 + a * np.exp(b / cos_theta)) * (1.0 + c * np.exp(d * np.arccos(cos_gamma)) + e * cos_gamma**2)
        for norm, (a, b, c, d, e) in zip(normalisation, coefficients, strict=True)
    )
    xyz = np.stack([x / y * luminance, luminance, (1.0 - x - y) / y * luminance], -1)
    rgb = np.maximum(xyz @ np.array(_TO_RGB)[:, :3].T, 0.0)
    return np.array([(rgb * cos_theta[..., None] ** power).mean((0, 1)) for power in range(3)])


def _gains(moments: np.ndarray, mean: np.ndarray, cosine_mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Factors at the horizon and at the zenith, (3,) each, linear in the cosine between, that give a sky the mean.

    All colours fall off alike, so that the luminance has the cosine's mean too, where that needs no other shape.
    """
    moments = np.maximum(moments, 1e-6)
    m0, m1, m2 = moments @ _LUMINANCE
    a, b = np.linalg.solve([[m0, m1], [m1, m2]], [mean @ _LUMINANCE, 0.5 * cosine_mean @ _LUMINANCE])
    zenith = np.clip(1.0 + b / a, 1.0 / _STEEPEST, _STEEPEST) if a > 0 else _STEEPEST  # over the horizon's
    horizon = mean / (moments[0] + (zenith - 1.0) * moments[1])
    return horizon, horizon * zenith


def sky(call, direction):
    """Radiance of the sky, as the node's colour, along `direction`."""
    g, node = call.graph, call.node
    if node.sky_type in _NISHITA:
        call.unsupported("this sky model is approximated by Preetham's, without the sun's disc")
        elevation, azimuth = node.sun_elevation, node.sun_rotation
        sun = (math.sin(azimuth) * math.cos(elevation), math.cos(azimuth) * math.cos(elevation), math.sin(elevation))
        turbidity = 2.0 + 2.0 * max(0.0, min(4.0, getattr(node, "aerosol_density", getattr(node, "dust_density", 1.0))))
        scale = 5.0 if node.sky_type == "SINGLE_SCATTERING" else 7.0
    else:
        sun, turbidity, scale = tuple(node.sun_direction), node.turbidity, 1.0
        if node.sky_type == "HOSEK_WILKIE":
            call.unsupported("the Hosek-Wilkie sky is approximated by Preetham's with its mean colour")
            # Preetham's zenith has no sense below a turbidity of about 2.
            turbidity = max(turbidity, 2.0)
    norm = math.sqrt(sum(x * x for x in sun)) or 1.0
    sun = tuple(x / norm for x in sun)
    # The model knows no sun below the horizon.
    theta_sun = min(math.acos(max(-1.0, min(1.0, sun[2]))), math.radians(89.0))
    zenith = _zenith(turbidity, theta_sun)
    unit = g.normalize(direction)
    cos_theta = g.max(g.component(unit, 2), g.const(_LOWEST))
    cos_gamma = g.clamp(g.dot(unit, g.const(*sun)), -1.0, 1.0)
    gamma = g.function(op.MATH_ACOS, cos_gamma)
    # The three channels of Perez' formula at once.
    coefficients = [[t[0] * turbidity + t[1] for t in _PEREZ[channel]] for channel in "Yxy"]
    a, b, c, d, e = (g.const(*(row[i] for row in coefficients)) for i in range(5))
    inverse = g.div(g.one, cos_theta)
    exp_theta = g.by_component(op.MATH_EXP, g.mul(b, inverse))
    exp_gamma = g.by_component(op.MATH_EXP, g.mul(d, gamma))
    value = g.mul(g.fma(a, exp_theta, g.one), g.fma(c, exp_gamma, g.fma(e, g.mul(cos_gamma, cos_gamma), g.one)))
    normalisation = [zenith[ch] / _perez(row, 0.0, theta_sun) for ch, row in zip("Yxy", coefficients, strict=True)]
    normalisation[0] *= _UNIT * scale
    value = g.mul(value, g.const(*normalisation))
    luminance, x, y = (g.component(value, i) for i in range(3))
    big_x = g.mul(g.div(x, y), luminance)
    big_z = g.mul(g.div(g.sub(g.one_minus(x), y), y), luminance)
    color = g.max(g.matrix(g.combine(big_x, luminance, big_z), _TO_RGB), g.zero)
    if node.sky_type != "HOSEK_WILKIE":
        return color
    wanted = mean_radiance(node.turbidity, node.ground_albedo, math.pi / 2.0 - theta_sun)
    horizon, zenith = _gains(_moments(coefficients, normalisation, theta_sun), *wanted)
    return g.mul(color, g.mix(g.const(*horizon.tolist()), g.const(*zenith.tolist()), cos_theta))

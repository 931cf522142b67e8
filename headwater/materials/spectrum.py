# SPDX-License-Identifier: Apache-2.0
"""Blackbody and wavelength colours: Planck's law and the CIE 1931 2-degree observer (CIE 15:2004, 5 nm), as tables.

Linear Rec. 709, negative components set to 0. A blackbody's colour has luminance 1, as in Blender's Blackbody node.
"""

import functools

import numpy as np

from headwater.materials.expression import Expr, Graph

# x, y, z bar from 380 nm in steps of 5 nm, to 780 nm.
_OBSERVER = np.array(
    """
    .0014 .0000 .0065 .0022 .0001 .0105 .0042 .0001 .0201 .0076 .0002 .0362 .0143 .0004 .0679 .0232 .0006 .1102
    .0435 .0012 .2074 .0776 .0022 .3713 .1344 .0040 .6456 .2148 .0073 1.0391 .2839 .0116 1.3856 .3285 .0168 1.6230
    .3483 .0230 1.7471 .3481 .0298 1.7826 .3362 .0380 1.7721 .3187 .0480 1.7441 .2908 .0600 1.6692 .2511 .0739 1.5281
    .1954 .0910 1.2876 .1421 .1126 1.0419 .0956 .1390 .8130 .0580 .1693 .6162 .0320 .2080 .4652 .0147 .2586 .3533
    .0049 .3230 .2720 .0024 .4073 .2123 .0093 .5030 .1582 .0291 .6082 .1117 .0633 .7100 .0782 .1096 .7932 .0573
    .1655 .8620 .0422 .2257 .9149 .0298 .2904 .9540 .0203 .3597 .9803 .0134 .4334 .9950 .0087 .5121 1.0000 .0057
    .5945 .9950 .0039 .6784 .9786 .0027 .7621 .9520 .0021 .8425 .9154 .0018 .9163 .8700 .0017 .9786 .8163 .0014
    1.0263 .7570 .0011 1.0567 .6949 .0010 1.0622 .6310 .0008 1.0456 .5668 .0006 1.0026 .5030 .0003 .9384 .4412 .0002
    .8544 .3810 .0002 .7514 .3210 .0001 .6424 .2650 .0000 .5419 .2170 .0000 .4479 .1750 .0000 .3608 .1382 .0000
    .2835 .1070 .0000 .2187 .0816 .0000 .1649 .0610 .0000 .1212 .0446 .0000 .0874 .0320 .0000 .0636 .0232 .0000
    .0468 .0170 .0000 .0329 .0119 .0000 .0227 .0082 .0000 .0158 .0057 .0000 .0114 .0041 .0000 .0081 .0029 .0000
    .0058 .0021 .0000 .0041 .0015 .0000 .0029 .0010 .0000 .0020 .0007 .0000 .0014 .0005 .0000 .0010 .0004 .0000
    .0007 .0002 .0000 .0005 .0002 .0000 .0003 .0001 .0000 .0002 .0001 .0000 .0002 .0001 .0000 .0001 .0000 .0000
    .0001 .0000 .0000 .0001 .0000 .0000 .0000 .0000 .0000
    """.split(),
    np.float64,
).reshape(-1, 3)
_WAVELENGTHS = 380.0 + 5.0 * np.arange(len(_OBSERVER))
_XYZ_TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
_COOLEST, _HOTTEST = 800.0, 12000.0  # Blender's range: colours beyond are those at its ends


def blackbody_color(kelvin: float) -> np.ndarray:
    """Linear Rec. 709 of a blackbody, luminance 1, (3,)."""
    t = min(max(float(kelvin), _COOLEST), _HOTTEST)
    metres = _WAVELENGTHS * 1e-9
    # Planck: c1 / l^5 / (exp(c2 / (l T)) - 1), c2 = h c / k; c1 cancels.
    power = (1e-7 / metres) ** 5 / np.expm1(1.438776877e-2 / (metres * t))
    xyz = power @ _OBSERVER
    return np.maximum(_XYZ_TO_RGB @ (xyz / xyz[1]), 0.0)


@functools.cache
def _blackbody_table() -> np.ndarray:
    # Even steps in 1/T: the colour is nearly linear in it.
    inverse = np.linspace(1.0 / _COOLEST, 1.0 / _HOTTEST, 512)
    rows = np.zeros((512, 4), np.float32)
    rows[:, :3] = [blackbody_color(1.0 / x) for x in inverse]
    return rows


def blackbody(g: Graph, kelvin: Expr) -> Expr:
    if kelvin.constant:
        return g.const(*blackbody_color(kelvin.scalar))
    span = 1.0 / (1.0 / _COOLEST - 1.0 / _HOTTEST)
    inverse = g.div(g.one, g.max(kelvin, g.const(_COOLEST)))
    return g.table(g.fma(inverse, g.const(-span), g.const(span / _COOLEST)), _blackbody_table())


@functools.cache
def _wavelength_table() -> np.ndarray:
    rows = np.zeros((len(_OBSERVER) + 2, 4), np.float32)
    # Blender's scale, so that the brightest component is about 1; black outside the visible range.
    rows[1:-1, :3] = _OBSERVER @ _XYZ_TO_RGB.T / 2.52
    return rows


def wavelength(g: Graph, nanometres: Expr) -> Expr:
    rows = _wavelength_table()
    first = _WAVELENGTHS[0] - 5.0
    extent = 5.0 * (len(rows) - 1)
    # Negative components are cut off after blending between entries.
    return g.max(g.table(g.fma(nanometres, g.const(1.0 / extent), g.const(-first / extent)), rows), g.zero)


__all__ = ["blackbody", "blackbody_color", "wavelength"]

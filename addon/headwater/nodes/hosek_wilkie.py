# SPDX-License-Identifier: GPL-3.0-or-later
"""How bright the sky of Hosek and Wilkie 2012, "An analytic model for full spectral sky-dome radiance", is on average.

Not their formula: the mean over the sky, and the mean weighed by the cosine to the zenith, as Cycles 5.0.1 renders
them, by blender_tests/measure_sky.py. Their model is tabulated over turbidity, the ground's albedo (in which it is
linear) and the cube root of the sun's height.
"""

import numpy as np

_TURBIDITY = (1.0, 2.0, 3.0, 4.5, 7.0, 10.0)
_ELEVATION = (0.5, 3.0, 8.0, 15.0, 25.0, 40.0, 60.0, 85.0)  # degrees
# Linear Rec. 709 with an albedo of 0.3, rows by turbidity, columns by elevation.
_MEAN = (
    (
        (0.0205, 0.0177, 0.0116),
        (0.0288, 0.0318, 0.0273),
        (0.0371, 0.0507, 0.0570),
        (0.0433, 0.0669, 0.0884),
        (0.0479, 0.0800, 0.1196),
        (0.0508, 0.0892, 0.1482),
        (0.0530, 0.0937, 0.1644),
        (0.0568, 0.1000, 0.1710),
    ),
    (
        (0.0211, 0.0175, 0.0115),
        (0.0323, 0.0329, 0.0272),
        (0.0444, 0.0545, 0.0576),
        (0.0524, 0.0725, 0.0900),
        (0.0570, 0.0865, 0.1217),
        (0.0580, 0.0954, 0.1507),
        (0.0580, 0.0983, 0.1676),
        (0.0639, 0.1046, 0.1737),
    ),
    (
        (0.0212, 0.0168, 0.0112),
        (0.0364, 0.0341, 0.0269),
        (0.0541, 0.0599, 0.0582),
        (0.0655, 0.0810, 0.0921),
        (0.0707, 0.0963, 0.1254),
        (0.0705, 0.1048, 0.1553),
        (0.0668, 0.1063, 0.1721),
        (0.0722, 0.1119, 0.1748),
    ),
    (
        (0.0193, 0.0151, 0.0106),
        (0.0411, 0.0350, 0.0261),
        (0.0715, 0.0687, 0.0590),
        (0.0919, 0.0972, 0.0957),
        (0.1004, 0.1168, 0.1324),
        (0.0973, 0.1265, 0.1663),
        (0.0871, 0.1260, 0.1849),
        (0.0940, 0.1260, 0.1769),
    ),
    (
        (0.0154, 0.0128, 0.0098),
        (0.0413, 0.0333, 0.0245),
        (0.0850, 0.0733, 0.0582),
        (0.1179, 0.1108, 0.0982),
        (0.1356, 0.1388, 0.1398),
        (0.1380, 0.1568, 0.1814),
        (0.1249, 0.1574, 0.2052),
        (0.1224, 0.1449, 0.1876),
    ),
    (
        (0.0101, 0.0091, 0.0079),
        (0.0294, 0.0228, 0.0173),
        (0.0741, 0.0580, 0.0456),
        (0.1265, 0.1060, 0.0895),
        (0.1770, 0.1613, 0.1461),
        (0.2316, 0.2243, 0.2138),
        (0.2605, 0.2674, 0.2621),
        (0.1994, 0.2047, 0.2191),
    ),
)
_COSINE_MEAN = (
    (
        (0.0125, 0.0126, 0.0103),
        (0.0169, 0.0216, 0.0230),
        (0.0214, 0.0332, 0.0453),
        (0.0255, 0.0435, 0.0678),
        (0.0290, 0.0527, 0.0910),
        (0.0313, 0.0605, 0.1151),
        (0.0347, 0.0662, 0.1315),
        (0.0384, 0.0735, 0.1390),
    ),
    (
        (0.0128, 0.0125, 0.0103),
        (0.0183, 0.0222, 0.0230),
        (0.0244, 0.0351, 0.0457),
        (0.0298, 0.0465, 0.0690),
        (0.0347, 0.0573, 0.0930),
        (0.0378, 0.0666, 0.1184),
        (0.0408, 0.0727, 0.1365),
        (0.0467, 0.0816, 0.1443),
    ),
    (
        (0.0129, 0.0122, 0.0101),
        (0.0201, 0.0230, 0.0230),
        (0.0286, 0.0379, 0.0461),
        (0.0363, 0.0512, 0.0704),
        (0.0435, 0.0643, 0.0964),
        (0.0490, 0.0763, 0.1241),
        (0.0511, 0.0839, 0.1445),
        (0.0607, 0.0923, 0.1503),
    ),
    (
        (0.0124, 0.0116, 0.0098),
        (0.0231, 0.0241, 0.0229),
        (0.0376, 0.0434, 0.0471),
        (0.0511, 0.0616, 0.0732),
        (0.0640, 0.0803, 0.1032),
        (0.0740, 0.0987, 0.1380),
        (0.0764, 0.1103, 0.1645),
        (0.0881, 0.1174, 0.1645),
    ),
    (
        (0.0111, 0.0106, 0.0093),
        (0.0256, 0.0247, 0.0223),
        (0.0472, 0.0483, 0.0476),
        (0.0682, 0.0721, 0.0760),
        (0.0908, 0.0993, 0.1112),
        (0.1134, 0.1319, 0.1582),
        (0.1228, 0.1528, 0.1966),
        (0.1294, 0.1509, 0.1898),
    ),
    (
        (0.0091, 0.0088, 0.0082),
        (0.0247, 0.0212, 0.0178),
        (0.0549, 0.0481, 0.0427),
        (0.0892, 0.0815, 0.0766),
        (0.1349, 0.1297, 0.1260),
        (0.2152, 0.2126, 0.2075),
        (0.2948, 0.3029, 0.2904),
        (0.2474, 0.2522, 0.2647),
    ),
)
_ALBEDO = 0.3
# What an albedo of 1 adds to that of 0, over the mean with _ALBEDO.
_REFLECTED_TURBIDITY, _REFLECTED_ELEVATION = (2.0, 4.5), (3.0, 25.0, 60.0)
_REFLECTED = (
    ((0.076, 0.097, 0.119), (0.410, 0.419, 0.403), (0.851, 0.814, 0.725)),
    ((0.061, 0.086, 0.102), (0.286, 0.321, 0.354), (0.697, 0.696, 0.653)),
)
_COSINE_REFLECTED = (
    ((0.079, 0.094, 0.103), (0.406, 0.417, 0.388), (0.729, 0.728, 0.656)),
    ((0.062, 0.082, 0.083), (0.253, 0.296, 0.332), (0.442, 0.518, 0.540)),
)


def _between(table, rows, columns, turbidity: float, degrees: float) -> np.ndarray:
    """Of a table (R, C, 3), at the ends its own values, linear between."""
    table = np.array(table)
    heights = np.cbrt(columns)
    at = [[np.interp(np.cbrt(degrees), heights, row[:, channel]) for channel in range(3)] for row in table]
    return np.array([np.interp(turbidity, rows, [row[channel] for row in at]) for channel in range(3)])


def mean_radiance(turbidity: float, albedo: float, elevation: float) -> tuple[np.ndarray, np.ndarray]:
    """Means over the directions above the horizon, (3,), as the node's colour: plain, and weighed by the cosine to the
    zenith (the irradiance of the ground over pi). elevation: of the sun, radians."""
    degrees = max(float(np.degrees(elevation)), 0.0)
    means = []
    for mean, reflected in ((_MEAN, _REFLECTED), (_COSINE_MEAN, _COSINE_REFLECTED)):
        base = _between(mean, _TURBIDITY, _ELEVATION, turbidity, degrees)
        more = _between(reflected, _REFLECTED_TURBIDITY, _REFLECTED_ELEVATION, turbidity, degrees)
        means.append(base * np.maximum(1.0 + (albedo - _ALBEDO) * more, 0.0))
    return means[0], means[1]

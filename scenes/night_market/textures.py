# SPDX-License-Identifier: Apache-2.0
"""Pictures of the night market, made with NumPy and packed into the .blend: colours, roughness and normal maps.

Arrays are (height, width[, channels]) in [0, 1], bottom row first as Blender stores them, tileable in both directions.
Colour pictures are given as sRGB-encoded values.
"""

import bpy
import numpy as np


def noise(shape, cells, seed, octaves=4):
    """Tileable value noise in [0, 1]: `cells` = (rows, columns) of the coarsest octave, smoothstep between them."""
    rng = np.random.default_rng(seed)
    total, weight = np.zeros(shape), 0.0
    for octave in range(octaves):
        rows, columns = (min(c << octave, s) for c, s in zip(cells, shape, strict=True))
        grid = rng.random((rows, columns))
        y, x = (np.arange(s) / s * c for s, c in zip(shape, (rows, columns), strict=True))
        iy, ix = y.astype(int), x.astype(int)
        fy, fx = ((f * f * (3 - 2 * f)) for f in (y - iy, x - ix))
        fy, fx = fy[:, None], fx[None, :]
        ny, nx = (iy + 1) % rows, (ix + 1) % columns
        lower = grid[np.ix_(iy, ix)] * (1 - fx) + grid[np.ix_(iy, nx)] * fx
        upper = grid[np.ix_(ny, ix)] * (1 - fx) + grid[np.ix_(ny, nx)] * fx
        total += (lower * (1 - fy) + upper * fy) * 0.5**octave
        weight += 0.5**octave
    return total / weight


def image(name, pixels, colour=True):
    """A packed Blender image from (H, W) or (H, W, 3) values in [0, 1]; colour: sRGB, else non-colour data."""
    pixels = np.asarray(pixels, np.float32)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    height, width = pixels.shape[:2]
    picture = bpy.data.images.new(name, width, height, alpha=False)
    picture.colorspace_settings.name = "sRGB" if colour else "Non-Color"
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = np.clip(pixels, 0, 1)
    picture.pixels.foreach_set(rgba.ravel())
    picture.update()
    picture.pack()
    return picture


def environment(name, pixels):
    """A packed float image of scene-linear radiance (H, W, 3), equirectangular."""
    height, width = pixels.shape[:2]
    picture = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels
    picture.pixels.foreach_set(rgba.ravel())
    picture.update()
    picture.pack()
    return picture


def normals(height_map, pixels_per_unit, depth):
    """Tangent-space normal map (OpenGL, green up) of a tileable height map; depth and pixels_per_unit in one unit."""
    dx = (np.roll(height_map, -1, 1) - np.roll(height_map, 1, 1)) * 0.5 * pixels_per_unit * depth
    dy = (np.roll(height_map, -1, 0) - np.roll(height_map, 1, 0)) * 0.5 * pixels_per_unit * depth
    normal = np.dstack([-dx, -dy, np.ones_like(dx)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return normal * 0.5 + 0.5


def mix(a, b, t):
    """Linear mix of two colours (3,) by a map (H, W)."""
    t = t[..., None]
    return np.asarray(a, float) * (1 - t) + np.asarray(b, float) * t


def bricks(shape, rows, columns, seed, mortar=0.09):
    """Running bond: (height in [0, 1] with rounded edges, a random number for every brick), both (H, W)."""
    rng = np.random.default_rng(seed)
    y, x = np.meshgrid(np.arange(shape[0]) / shape[0] * rows, np.arange(shape[1]) / shape[1] * columns, indexing="ij")
    row = y.astype(int)
    x = (x + 0.5 * (row % 2)) % columns
    column = x.astype(int)
    fx, fy = x - column, y - row
    edge = np.minimum(np.minimum(fx, 1 - fx) * (rows / columns) ** 0, np.minimum(fy, 1 - fy))
    height = np.clip((edge - mortar * 0.4) / mortar, 0, 1)
    height = np.sqrt(1 - (1 - height) ** 2)
    return height, rng.random((rows, columns))[row, column]


def wet_street():
    """6 m by 12 m of wet setts with puddles: (colour, roughness, normal) at 170 pixels a metre."""
    shape = (2048, 1024)
    stone, tone = bricks(shape, 96, 36, 11, mortar=0.22)
    rough_noise = noise(shape, (24, 12), 12, 6)
    dips = noise(shape, (7, 4), 13, 4)
    puddle = np.clip((dips - 0.475) / 0.08, 0, 1)
    height = (stone * (0.8 + 0.4 * tone) + 0.25 * rough_noise) * (1 - puddle) + 0.9 * puddle
    damp = 0.10 + 0.24 * rough_noise + 0.10 * (1 - stone)
    roughness = damp * (1 - puddle) + 0.03 * puddle
    dry = mix((0.17, 0.17, 0.19), (0.27, 0.25, 0.25), tone) * (0.45 + 0.55 * stone)[..., None]
    colour = dry * (1 - 0.45 * puddle)[..., None] * (0.75 + 0.5 * rough_noise)[..., None]
    return (
        image("Wet setts", colour),
        image("Wet setts roughness", roughness, colour=False),
        image("Wet setts normal", normals(height, 170, 0.006), colour=False),
    )


def wall_bricks():
    """2.4 m of brickwork: (colour, roughness, normal)."""
    shape = (512, 512)
    stone, tone = bricks(shape, 32, 12, 21, mortar=0.12)
    grime = noise(shape, (4, 4), 22, 5)
    colour = mix((0.34, 0.31, 0.29), (0.52, 0.27, 0.21), stone * (0.65 + 0.35 * tone)) * (0.55 + 0.6 * grime)[..., None]
    return (
        image("Bricks", colour),
        image("Bricks roughness", 0.72 + 0.2 * grime, colour=False),
        image("Bricks normal", normals(stone + 0.2 * grime, 213, 0.012), colour=False),
    )


def plaster(name, tint, seed):
    """3 m of stained plaster in a tint (sRGB): (colour, normal)."""
    shape = (512, 512)
    stain = noise(shape, (3, 8), seed, 6)
    drips = noise(shape, (2, 48), seed + 1, 3)
    wear = np.clip(0.62 + 0.55 * (stain - 0.5) - 0.35 * np.clip(drips - 0.58, 0, 1), 0, 1)
    colour = np.asarray(tint) * wear[..., None] * 1.25
    return image(name, colour), image(f"{name} normal", normals(stain, 170, 0.03), colour=False)


def planks():
    """1 m of weathered boards, running along u: (colour, roughness, normal)."""
    shape = (512, 512)
    board = np.arange(512) / 512 * 6
    index = board.astype(int)
    groove = np.clip(np.minimum(board - index, 1 + index - board) / 0.05, 0, 1)[:, None]
    rng = np.random.default_rng(31)
    tone = rng.random(6)[index][:, None]
    grain = noise(shape, (96, 3), 32, 4)
    colour = mix((0.30, 0.19, 0.12), (0.55, 0.38, 0.24), np.clip(0.35 * tone + 0.75 * grain, 0, 1)) * groove[..., None]
    return (
        image("Boards", colour),
        image("Boards roughness", 0.5 + 0.35 * grain, colour=False),
        image("Boards normal", normals(groove * np.ones(shape) + 0.3 * grain, 512, 0.004), colour=False),
    )


def stripes(name, first, second):
    """Eight stripes of two colours (sRGB) across u, with weave and stains."""
    shape = (256, 512)
    band = ((np.arange(512) // 32) % 2).astype(float)[None, :] * np.ones((256, 1))
    stain = noise(shape, (3, 6), 41, 5)
    weave = 0.96 + 0.04 * np.indices(shape).sum(0) % 2
    return image(name, mix(first, second, band) * (0.72 + 0.45 * stain)[..., None] * weave[..., None])


def glowing_window(name, light, dark, seed, curtain):
    """A lit window: panes by glazing bars, a curtain's folds at the sides, a brighter lamp area (sRGB)."""
    shape = (192, 128)
    y, x = np.indices(shape) / np.array(shape).reshape(2, 1, 1)
    rng = np.random.default_rng(seed)
    lamp = np.exp(-(((x - rng.uniform(0.3, 0.7)) / 0.35) ** 2 + ((y - 0.7) / 0.4) ** 2))
    room = mix(dark, light, np.clip(0.35 + 0.65 * lamp, 0, 1))
    open_part = 0.5 - curtain
    folds = 0.55 + 0.25 * np.sin(x * 70 + 3 * np.sin(y * 3))
    drawn = np.abs(x - 0.5) > open_part
    room[drawn] = (room * np.array([1.0, 0.72, 0.5]) * folds[..., None])[drawn]
    shelf = (y < 0.22 + 0.12 * noise(shape, (1, 9), seed, 1)) & ~drawn
    room[shelf] *= 0.25
    return image(name, room)


def sign(name, paper, ink, seed, strokes=5):
    """A shop sign of invented brush marks, in columns (sRGB); no writing system's characters."""
    shape = (256, 128)
    y, x = np.indices(shape) / np.array(shape).reshape(2, 1, 1)
    rng = np.random.default_rng(seed)
    mark = np.zeros(shape)
    for cell in range(3):
        cy = 0.17 + cell * 0.33
        for _ in range(strokes):
            a = np.array([rng.uniform(0.25, 0.75), cy + rng.uniform(-0.11, 0.11)])
            d = rng.choice([-1, 1]) * np.array([rng.uniform(0.1, 0.3), 0.02])
            if rng.random() < 0.5:
                d = np.array([0.02, rng.uniform(0.08, 0.14)])
            b = np.clip(a + d, [0.18, cy - 0.13], [0.82, cy + 0.13])
            ab = b - a
            t = np.clip(((x - a[0]) * ab[0] + (y - a[1]) * ab[1]) / (ab @ ab + 1e-9), 0, 1)
            distance = np.hypot((x - a[0] - t * ab[0]) * 0.5, y - a[1] - t * ab[1])
            mark = np.maximum(mark, np.clip(1.5 - distance / (0.014 - 0.006 * t), 0, 1))
    rim = (np.minimum(x, 1 - x) < 0.06) | (np.minimum(y, 1 - y) < 0.03)
    picture = mix(paper, ink, mark)
    picture[rim] = ink
    return image(name, picture)


def paper(name, tint):
    """Lantern paper: bamboo ribs in v, fibres, brighter in the middle (sRGB)."""
    shape = (128, 128)
    y = np.indices(shape)[0] / 128
    fibre = noise(shape, (8, 8), 51, 4)
    ribs = 0.78 + 0.22 * np.abs(np.sin(y * np.pi * 10)) ** 0.4
    glow = 0.72 + 0.28 * np.sin(np.pi * y)
    return image(name, np.asarray(tint) * (ribs * glow * (0.85 + 0.3 * fibre))[..., None])


def fish_scales():
    """A paper carp's skin along v: overlapping scales, red to gold to white (sRGB)."""
    shape = (256, 256)
    y, x = np.indices(shape) / 256
    v, u = y * 14, x * 12
    row = np.floor(v)
    u = u + 0.5 * (row % 2)
    rim = np.hypot((u % 1) - 0.5, (v % 1) * 0.9)
    scale = np.where(np.abs(rim - 0.55) < 0.1, 0.45, 0.8 + 0.2 * (v % 1))
    along = np.clip(y * 1.4 - 0.1, 0, 1)
    tint = mix((1.0, 0.16, 0.06), (1.0, 0.66, 0.18), along)
    patch = np.clip((noise(shape, (5, 5), 55, 3) - 0.55) / 0.05, 0, 1)
    tint = tint * (1 - patch[..., None]) + np.array([1.0, 0.9, 0.8]) * patch[..., None]
    return image("Fish scales", tint * scale[..., None])


def night_sky():
    """Equirectangular night: deep blue above, a town's warm haze along the horizon, stars. Scene-linear radiance."""
    height, width = 256, 512
    y = (np.arange(height) + 0.5) / height
    elevation = (y - 0.5) * np.pi
    haze = np.exp(-np.abs(elevation) / 0.16)[:, None, None]
    zenith = np.clip(np.sin(elevation), 0, 1)[:, None, None]
    sky = 0.045 * np.array([0.13, 0.28, 1.0]) * (1.0 - 0.55 * zenith) + haze * np.array([0.060, 0.030, 0.070])
    cloud = noise((height, width), (4, 8), 61, 5)[..., None]
    sky = sky * (0.65 + 0.8 * cloud) * np.ones((1, width, 1))
    sky[: height // 2] *= 0.25
    rng = np.random.default_rng(62)
    rows, columns = rng.integers(int(height * 0.56), height, 240), rng.integers(0, width, 240)
    sky[rows, columns] += (rng.pareto(2.5, 240)[:, None] * 0.03 + 0.02) * rng.uniform(0.7, 1.0, (240, 3))
    return environment("Night sky", sky)

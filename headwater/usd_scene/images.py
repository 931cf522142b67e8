# SPDX-License-Identifier: Apache-2.0
"""Image files of USD materials and domes as the core's images: each file once, also those inside .usdz packages."""

import os
import tempfile

import numpy as np

from headwater.errors import UserError
from headwater.texture_io import load_texture
from headwater.usd_scene.ids import path_id


class Images:
    """Loads image files into `scene`; a missing or broken one becomes the core's missing image, with a warning."""

    def __init__(self, scene, report):
        self._scene = scene
        self._report = report
        self._known = {}

    def load(self, path: str, color_space: str, user) -> int:
        """The image id of a resolved asset path. color_space: "auto", "sRGB", "raw" (UsdUVTexture's names); `user`: the
        prim a warning is to name. auto: 8-bit images with colour are sRGB, everything else is linear."""
        key = (path, color_space)
        if key in self._known:
            return self._known[key]
        identifier = path_id(path, color_space)
        try:
            pixels, srgb = self._read(path, color_space)
        except UserError as error:
            self._report.warn(user, str(error))
            pixels, srgb = None, False
        name = os.path.basename(path) or str(user)
        try:
            self._scene.upsert_image(identifier, name, pixels, srgb=srgb)
        except ValueError as error:
            self._report.warn(user, f"image '{path}': {error}")
            self._scene.upsert_image(identifier, name, None)
        self._known[key] = identifier
        return identifier

    def _read(self, path, color_space):
        if not path:
            raise UserError("a texture has no file, or its file was not found")
        texture = read_asset(path)
        pixels = texture.pixels
        if texture.is_float and not np.isfinite(pixels).all():
            self._report.warn(path, "it has pixels that are not finite; they are taken as 0")
            pixels = np.nan_to_num(pixels, nan=0.0, posinf=0.0, neginf=0.0)
        srgb = color_space == "sRGB" or (color_space == "auto" and not texture.is_float and pixels.shape[2] >= 3)
        if srgb and texture.is_float:
            # Float texels marked sRGB hold encoded values; the core decodes only 8-bit texels.
            decoded = np.where(pixels <= 0.04045, pixels / 12.92, ((np.maximum(pixels, 0) + 0.055) / 1.055) ** 2.4)
            pixels = np.concatenate([decoded[..., :3], pixels[..., 3:]], axis=2).astype(np.float32)
            srgb = False
        return pixels, srgb


def read_asset(path: str):
    """The texture at a resolved asset path; files inside packages ("scene.usdz[maps/wood.png]") too."""
    if not path.endswith("]"):
        return load_texture(path)
    from pxr import Ar

    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not asset:
        raise UserError(f"image '{path}' is not in its package")
    with tempfile.NamedTemporaryFile(suffix=os.path.splitext(path[:-1])[1]) as file:
        file.write(asset.GetBuffer())
        file.flush()
        texture = load_texture(file.name)
    texture.path = path
    return texture

# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels onto the screen: a texture that is made anew only when there is another picture."""

import gpu
from gpu_extras.presets import draw_texture_2d


class Drawer:
    """The texture of one viewport. Use only while Blender draws it."""

    def __init__(self):
        self._picture = self._texture = None

    def draw(self, engine, scene, picture, width: int, height: int) -> None:
        """Draws a worker.Picture over the viewport of that size in pixels, stretched when it was made for another."""
        if picture is not self._picture:
            rows, columns = picture.pixels.shape[:2]
            data = gpu.types.Buffer("FLOAT", picture.pixels.size, picture.pixels.reshape(-1))
            self._texture = gpu.types.GPUTexture((columns, rows), format="RGBA16F", data=data)
            self._picture = picture
        request = picture.request
        x0, y0, x1, y1 = request.region
        scale_x, scale_y = width / request.width, height / request.height
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        draw_texture_2d(self._texture, (x0 * scale_x, y0 * scale_y), (x1 - x0) * scale_x, (y1 - y0) * scale_y)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

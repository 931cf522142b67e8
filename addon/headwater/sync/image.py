# SPDX-License-Identifier: GPL-3.0-or-later
"""Image textures that materials use → core images: loaded once for each key, again when Blender says they changed."""

import numpy as np

from ..nodes import images as node_images


class ImageSync:
    """Images the core has, by key (nodes/images.py: data-block, frame, colour space, alpha mode)."""

    def __init__(self, scene, ids, notes):
        self._scene, self._ids, self._notes = scene, ids, notes
        self._loaded: set[tuple] = set()
        self._seen: set[tuple] = set()

    def begin(self, updates) -> None:
        self._seen = set()
        self._loaded = {key for key in self._loaded if key[0] not in updates.images}

    def keep(self, keys) -> None:
        """Images of a material that was not compiled again are still in use."""
        self._seen.update(keys)

    def require(self, request) -> tuple[int, tuple]:
        """The core's id of an image a program asks for, and its key. Uploads it where the core has it not."""
        key = node_images.image_key(request)
        self._seen.add(key)
        number = self._ids.get(("image", *key))
        if key not in self._loaded:
            pixels, settings = self._load(request)
            self._scene.upsert_image(number, settings.pop("name"), pixels, **settings)
            self._loaded.add(key)
        return number, key

    def _load(self, request):
        loaded = node_images.load_pixels(request)
        for note in loaded.notes:
            self._notes.add(note)
        pixels = None if loaded.pixels is None else np.ascontiguousarray(loaded.pixels)
        return pixels, {"name": loaded.name, "srgb": loaded.srgb, "premultiplied": loaded.premultiplied}

    def remove_unseen(self) -> None:
        """Removes images that no material of this sync uses."""
        for key in self._loaded - self._seen:
            self._scene.remove_image(self._ids.get(("image", *key)))
            self._ids.forget(("image", *key))
            self._loaded.discard(key)

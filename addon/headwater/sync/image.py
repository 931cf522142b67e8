# SPDX-License-Identifier: GPL-3.0-or-later
"""Image textures that materials use → core images: loaded once for each key, again when Blender says they changed.

Programs are sent before their images, for which missing ones stand in meanwhile: decoding is dear. Plain files are
decoded by the core's threads while Blender's meshes are read; for the others Blender is asked while the core builds.
"""

import numpy as np

from ..nodes import images as node_images
from . import decoded_files


class ImageSync:
    """Images the core has, by key (nodes/images.py: data-block, frame, colour space, alpha mode)."""

    def __init__(self, scene, ids, notes, decoder):
        """decoder: core.ImageDecoder."""
        self._scene, self._ids, self._notes = scene, ids, notes
        self._new_decoder = decoder
        self._decoder = None  # while it has files
        self._decoding: dict[tuple, tuple] = {}  # key → state of its file, its number there or what was kept of it
        self._loaded: set[tuple] = set()  # the core has their pixels
        self._volatile: set[tuple] = set()  # pixels that were in Blender's memory alone: undo may change them
        self._placed: set[tuple] = set()  # the core has at least a stand-in
        self._seen: set[tuple] = set()
        self._waiting: dict[tuple, object] = {}  # key → request

    def begin(self, updates) -> None:
        self._seen, self._waiting = set(), {}
        self.abandon()
        self._loaded = {key for key in self._loaded if not updates.image_changed(key[0], key in self._volatile)}

    def keep(self, keys) -> None:
        """Images of a material that was not compiled again are still in use."""
        self._seen.update(keys)

    def require(self, request) -> tuple[int, tuple]:
        """The core's id of an image a program asks for, and its key; `load` and `send` bring its pixels."""
        key = node_images.image_key(request)
        self._seen.add(key)
        number = self._ids.get(("image", *key))
        if key not in self._loaded:
            if key not in self._waiting:
                self._decode(key, request)
            self._waiting[key] = request
            if key not in self._placed:
                self._scene.upsert_image(number, request.image.name, None)
                self._placed.add(key)
        return number, key

    def _decode(self, key, request) -> None:
        """Begins to decode an image's file on another thread, where Blender is not needed for it."""
        file = node_images.plain_file(request)
        if file is None:
            return
        try:
            state = decoded_files.state(file)
        except OSError:
            return  # Blender says what is wrong with it
        known = decoded_files.find(key, state, request.image.name)
        if known is None:
            self._decoder = self._decoder or self._new_decoder()
            known = self._decoder.add(file)
        self._decoding[key] = (state, known)

    def send_decoded(self, breathe=None) -> None:
        """Sends what was decoded so far; with `breathe`, waits for the rest. What Blender has to read stays waiting."""
        while self._decoding:
            key, (state, known) = next(iter(self._decoding.items()))
            if breathe is not None:
                breathe()
            elif isinstance(known, int) and not self._decoder.done(known):
                return
            del self._decoding[key]
            loaded = known
            if isinstance(known, int):
                taken = self._decoder.take(known)
                loaded = node_images.decoded(self._waiting[key], *taken) if taken is not None else None
                if loaded is not None:
                    decoded_files.keep(key, state, loaded)
            if loaded is not None:
                del self._waiting[key]
                self._volatile.discard(key)
                self._send(key, loaded)
        self._decoder = None

    def load(self, breathe) -> list[tuple]:
        """Pixels of the images that are still waiting, for `send`. Does not touch the core's scene."""
        found = []
        for key, request in self._waiting.items():
            breathe()
            found.append((key, node_images.load_pixels(request)))
            in_memory = request.image.is_dirty or request.image.source == "GENERATED"
            (self._volatile.add if in_memory else self._volatile.discard)(key)
        self._waiting = {}
        return found

    def send(self, found: list[tuple]) -> None:
        for key, loaded in found:
            self._send(key, loaded)

    def abandon(self) -> None:
        """Forgets what is to be decoded, after the files that are under way."""
        self._decoder, self._decoding = None, {}

    def _send(self, key, loaded) -> None:
        for note in loaded.notes:
            self._notes.add(note, "Image", loaded.name)
        pixels = None if loaded.pixels is None else np.ascontiguousarray(loaded.pixels)
        number = self._ids.get(("image", *key))
        # Lent: nobody writes to loaded pixels any more.
        self._scene.upsert_image(
            number, loaded.name, pixels, srgb=loaded.srgb, premultiplied=loaded.premultiplied, lend=True
        )
        self._loaded.add(key)

    def remove_unseen(self) -> None:
        """Removes images that no material of this sync uses."""
        for key in self._placed - self._seen:
            self._scene.remove_image(self._ids.get(("image", *key)))
            self._ids.forget(("image", *key))
            self._loaded.discard(key)
            self._placed.discard(key)
            self._volatile.discard(key)

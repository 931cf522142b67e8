# SPDX-License-Identifier: Apache-2.0
"""Stable 64-bit ids from prim paths, so that the same prim is the same thing in every frame."""

import hashlib

INSTANCER_BITS = 26  # ids of one point instancer's copies follow each other: room for 67 million


def path_id(path, suffix: str = "") -> int:
    """A non-zero id of a prim path and a part of it. 38 bits of BLAKE2b above INSTANCER_BITS free bits."""
    digest = hashlib.blake2b(f"{path}\0{suffix}".encode(), digest_size=8).digest()
    return ((int.from_bytes(digest, "little") & ((1 << 38) - 1)) or 1) << INSTANCER_BITS


def random_id(path) -> int:
    """A 32-bit hash of a prim path, for per-object randomness in materials."""
    return int.from_bytes(hashlib.blake2b(str(path).encode(), digest_size=4).digest(), "little")

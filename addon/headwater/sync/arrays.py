# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of Blender's meshes: copied, or where they lie.

Where they lie: for what `foreach_get` reads element by element (the corners of triangles: on 111,000 triangles 9.6 ms,
where a copy takes 0.3 ms), and for what the core takes onto the device before Blender's data changes, so that none is
made at all. `as_pointer` of an element is its address. That they lie one behind the other is not promised, so it is
looked at: the first, a middle and the last element must be in their places and hold what Blender says they hold.
"""

import ctypes

import numpy as np

WORTH_BORROWING = 32 << 10  # bytes: copying fewer takes less time than looking at where they lie


def in_place(collection, prop: str, count: int, width: int, dtype) -> np.ndarray | None:
    """A view of all elements of a collection, (count, width), to be read before Blender's data changes.

    prop: the elements' property, an array of `width` values or, where that is 1, a number. None where the collection is
    no such array.
    """
    size = width * np.dtype(dtype).itemsize
    start = collection[0].as_pointer()
    places = {0, count // 2, count - 1}
    if any(collection[i].as_pointer() != start + i * size for i in places):
        return None
    # The ends are where they should be: what lies between belongs to the array.
    values = np.frombuffer((ctypes.c_byte * (count * size)).from_address(start), dtype).reshape(count, width)
    for i in places:
        said = getattr(collection[i], prop)
        if (tuple(said) if width > 1 else (said,)) != tuple(values[i].tolist()):
            return None
    values.flags.writeable = False
    return values


def read(collection, prop: str, count: int, width: int, dtype, borrow: bool = False) -> np.ndarray:
    """All elements of a collection, (count, width). borrow: a view (see in_place) where that is worth its checks."""
    if borrow and count * width * np.dtype(dtype).itemsize >= WORTH_BORROWING:
        values = in_place(collection, prop, count, width, dtype)
        if values is not None:
            return values
    values = np.empty((count, width), dtype)
    if count:
        collection.foreach_get(prop, values.reshape(-1))
    return values

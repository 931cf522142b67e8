# SPDX-License-Identifier: GPL-3.0-or-later
"""Where nothing happened but that plain objects moved: their new places, without a walk over all instances.

Blender names every object whose transform changed: also children, what is constrained to or driven by it, instancers of
a collection it is in. It names more than transforms for anything else: a scene where objects are hidden, linked or
removed, the object itself where its shape, materials or modifiers change. So it is enough to look at the named objects,
as long as each stands for one instance that no other object makes or takes part in. Else the walk is made.
"""

from dataclasses import dataclass

import bpy

NAMES_ALL = (4, 0, 0)


@dataclass
class Move:
    """A plain object that moved."""

    row: int  # among the instances of instance.Collected
    object: object  # evaluated


def plain_moves(depsgraph, updates, collected) -> list[Move] | None:
    """The objects that moved since the last sync, or None where more may have changed.

    updates: Updates since that sync; collected: what it made of the instances.
    """
    if not updates.only_moved or len(depsgraph.object_instances) != len(collected.index):
        return None
    moves = []
    for uid in updates.moved:
        found = collected.alone.get(uid)
        if found is None or uid in collected.involved:
            return None
        row, name = found
        original = bpy.data.objects.get(name)
        if original is None or original.session_uid != uid:  # one of a library, say
            return None
        moves.append(Move(row, original.evaluated_get(depsgraph)))
    return moves

# SPDX-License-Identifier: GPL-3.0-or-later
"""What our panels have in common: where they are and when they show."""

import textwrap

ENGINE = "HEADWATER"
LETTER = 5.8  # pixels that a letter of the interface's font is wide on average, at scale 1
MARGIN = 30.0  # pixels of a panel's width that a line of text cannot have: borders, scroll bar
ICON = 24.0


class HeadwaterPanel:
    """Mix-in for panels of the properties editor."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES and cls.applies(context)

    @classmethod
    def applies(cls, _context) -> bool:
        return True


def split(layout):
    """A column with names left and values right, as in all of Blender's property panels."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout.column()


def lines_of(context, text: str, indent: float = 0.0) -> list[str]:
    """A text broken into lines as wide as the region less `indent` pixels: Blender's labels are cut off at the edge."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    letters = (context.region.width / scale - MARGIN - indent) / LETTER
    return textwrap.wrap(text, max(int(letters), 16)) or [""]


def paragraph(layout, context, text: str) -> None:
    """A text over as many lines as it takes."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in lines_of(context, text):
        column.label(text=line)

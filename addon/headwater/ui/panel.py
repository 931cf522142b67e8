# SPDX-License-Identifier: GPL-3.0-or-later
"""What our panels have in common: where they are and when they show."""

ENGINE = "HEADWATER"


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

# SPDX-License-Identifier: GPL-3.0-or-later
"""One PropertyGroup for each integrator that reuses light samples: `scene.headwater.restir`, `.wssr_grid` and so on.

A group an integrator, not one for all, since the same parameter has another default in each. They are made from the
table in headwater/integrators.py, as are the command's options; docs/manual/reuse.md says what each does.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from headwater.integrators import INTEGRATORS, PARAMETERS, Choice, Number, Switch, Whole


def _property(parameter, default):
    """Blender's property for a parameter, with an integrator's default (the core's value)."""
    common = {"name": parameter.label, "description": f"{parameter.summary}. {parameter.effect}"}
    match parameter:
        case Whole(least=least, most=most, soft_most=soft_most):
            return IntProperty(min=least, max=most, soft_max=soft_most, default=default, **common)
        case Number(least=least, most=most, soft_most=soft_most, unit=unit):
            form = {"subtype": "DISTANCE", "unit": "LENGTH"} if unit == "metres" else {"subtype": "FACTOR"}
            return FloatProperty(min=least, max=most, soft_max=soft_most, default=default, **form, **common)
        case Switch(automatic=""):
            return BoolProperty(default=default, **common)
        case Switch():
            items = (("AUTO", "Automatic", parameter.automatic), ("ON", "On", "Always"), ("OFF", "Off", "Never"))
            return EnumProperty(items=items, default="AUTO", **common)
        case Choice(choices=choices):
            return EnumProperty(items=choices, default=default, **common)


def _group(integrator):
    """The PropertyGroup class of an integrator."""
    return type(
        f"Headwater{integrator.group.title().replace('_', '')}Settings",
        (bpy.types.PropertyGroup,),
        {
            "__doc__": f"Parameters of the integrator {integrator.name}",
            "__module__": __name__,
            "__annotations__": {
                name: _property(PARAMETERS[name], default) for name, default in integrator.defaults.items()
            },
        },
    )


groups = {integrator.group: _group(integrator) for integrator in INTEGRATORS.values() if integrator.defaults}


def settings(own) -> dict:
    """The core's settings for what `scene.headwater` chose: integrator, estimator, and the parameters it reads."""
    integrator = INTEGRATORS[own.integrator]
    chosen = {"integrator": integrator.name, "estimator": own.estimator}
    if integrator.defaults:
        group = getattr(own, integrator.group)
        chosen |= {name: PARAMETERS[name].from_property(getattr(group, name)) for name in integrator.defaults}
    return chosen


register, unregister = bpy.utils.register_classes_factory(tuple(groups.values()))

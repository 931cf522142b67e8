# SPDX-License-Identifier: GPL-3.0-or-later
"""One PropertyGroup for each integrator that reuses light samples and each of its estimators: `scene.headwater.restir`,
`.restir_unbiased`, `.wssr_grid` and so on.

A group each, not one for all, since the same parameter has another default in each. They are made from the table in
headwater/integrators.py, as are the command's options; docs/manual/reuse.md says what each does.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from headwater.integrators import INTEGRATORS, PARAMETERS, Choice, Number, Switch, Whole


def _property(parameter, default, estimator):
    """Blender's property for a parameter, with an integrator's default (the core's value) for an estimator."""
    common = {"name": parameter.label, "description": f"{parameter.summary}. {parameter.effect}"}
    match parameter:
        case Whole(soft_most=soft_most):
            least, most = parameter.range(estimator)
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


def _group(integrator, estimator):
    """The PropertyGroup class of an integrator's parameters with an estimator."""
    name = integrator.group(estimator)
    return type(
        f"Headwater{name.title().replace('_', '')}Settings",
        (bpy.types.PropertyGroup,),
        {
            "__doc__": f"Parameters of the integrator {integrator.name} with the estimator {estimator}",
            "__module__": __name__,
            "__annotations__": {
                parameter: _property(PARAMETERS[parameter], default, estimator)
                for parameter, default in integrator.parameters(estimator).items()
            },
        },
    )


groups = {
    integrator.group(estimator): _group(integrator, estimator)
    for integrator in INTEGRATORS.values()
    for estimator in (["paper"] if integrator.defaults else []) + (["unbiased"] if integrator.unbiased else [])
}


def group_of(own):
    """The group with the parameters of what `scene.headwater` chose, and their names: (None, ()) if there are none."""
    integrator = INTEGRATORS[own.integrator]
    names = tuple(integrator.parameters(own.estimator))
    return (getattr(own, integrator.group(own.estimator)), names) if names else (None, ())


def settings(own) -> dict:
    """The core's settings for what `scene.headwater` chose: integrator, estimator, and the parameters it reads. Those
    whose default depends on the scene are only sent where they were set."""
    group, names = group_of(own)
    chosen = {"integrator": own.integrator, "estimator": own.estimator}
    given = [name for name in names if not PARAMETERS[name].by_scene or group.is_property_set(name)]
    return chosen | {name: PARAMETERS[name].from_property(getattr(group, name)) for name in given}


register, unregister = bpy.utils.register_classes_factory(tuple(groups.values()))

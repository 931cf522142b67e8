# SPDX-License-Identifier: GPL-3.0-or-later
# Sampling preset "Draft": our own settings instead of Cycles'.
import bpy

own = bpy.context.scene.headwater
own.use_cycles_settings = False
own.samples = 16
own.max_bounces = 4
own.diffuse_bounces = 2
own.glossy_bounces = 2
own.transmission_bounces = 4

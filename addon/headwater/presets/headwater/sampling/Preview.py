# SPDX-License-Identifier: GPL-3.0-or-later
# Sampling preset "Preview": our own settings instead of Cycles'.
import bpy

own = bpy.context.scene.headwater
own.use_cycles_settings = False
own.samples = 64
own.max_bounces = 8
own.diffuse_bounces = 3
own.glossy_bounces = 3
own.transmission_bounces = 8

# SPDX-License-Identifier: GPL-3.0-or-later
# Sampling preset "Final": our own settings instead of Cycles'.
import bpy

own = bpy.context.scene.headwater
own.use_cycles_settings = False
own.samples = 512
own.max_bounces = 12
own.diffuse_bounces = 4
own.glossy_bounces = 4
own.transmission_bounces = 12

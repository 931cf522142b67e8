# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that Blender lacks, one PropertyGroup on each data-block: scene, view layer, light, material, world.

Where the Cycles add-on is there, `scene.headwater.use_cycles_settings` (on by default) takes sampling, light paths and
film from Cycles' own properties, so that an unmodified Cycles file looks the same: see render_settings.py and
docs/manual/settings.md. The groups here hold the same settings, with Cycles' defaults, for files without Cycles.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from headwater.integrators import DEFAULT_INTEGRATOR, ESTIMATORS, INTEGRATORS

from . import reuse_properties

_INPUT_PASSES = (
    ("RGB", "None", "The picture alone"),
    ("RGB_ALBEDO", "Albedo", "The picture and the colour of its surfaces"),
    ("RGB_ALBEDO_NORMAL", "Albedo and Normal", "The picture, and the colour and normals of its surfaces"),
)
_PREFILTERS = (
    ("NONE", "None", "Trust albedo and normal as they are: for those without noise"),
    ("FAST", "Fast", "Denoise picture, albedo and normal together"),
    ("ACCURATE", "Accurate", "Denoise albedo and normal before the picture"),
)
_QUALITIES = (
    ("HIGH", "High", "Best quality"),
    ("BALANCED", "Balanced", "Between quality and speed"),
    ("FAST", "Fast", "Best speed"),
)


def _passes_changed(_settings, context):
    """Denoising adds the pass Noisy Image: compositor nodes are to show it."""
    if context is not None and context.view_layer is not None:
        context.view_layer.update_render_passes()


class HeadwaterSceneSettings(bpy.types.PropertyGroup):
    use_cycles_settings: BoolProperty(
        name="Use Cycles' Settings",
        description="Take samples, bounces, clamping, pixel filter and exposure from the scene's Cycles settings",
        default=True,
    )
    integrator: EnumProperty(
        name="Integrator",
        description="How light is transported",
        items=tuple((each.name, each.label, each.description.rstrip(".")) for each in INTEGRATORS.values()),
        default=DEFAULT_INTEGRATOR,
    )
    estimator: EnumProperty(
        name="Estimator",
        description="How reservoirs are merged, which decides whether the picture is biased",
        items=ESTIMATORS,
        default="paper",
    )
    light_choice: EnumProperty(
        name="Light Choice",
        description="How next-event estimation chooses among the lights",
        items=(
            (
                "auto",
                "Automatic",
                "By the light tree where there are several lights; by power where there are few, and for integrators "
                "that reuse light samples",
            ),
            (
                "tree",
                "Light Tree",
                "By what each light could bring to the point that is lit: its distance, its direction, its power. Less "
                "noise with many lights, for somewhat more time a sample. Path Tracing only",
            ),
            ("power", "Power", "In proportion to the power each light sends out"),
            ("uniform", "Uniform", "Every light with the same probability"),
        ),
        default="auto",
    )
    tracer: EnumProperty(
        name="Ray Tracing",
        description="What finds the hits of rays",
        items=(
            ("auto", "Automatic", "Ray queries or ray tracing pipelines on GPUs that have them, Embree on the CPU"),
            ("ray_query", "Vulkan Ray Query", "Ray tracing hardware through Vulkan ray queries"),
            ("embree", "Embree", "Embree on the host's processor"),
            (  # last: files keep the number
                "ray_pipeline",
                "Vulkan Ray Pipeline",
                "Ray tracing hardware through Vulkan ray tracing pipelines, for GPUs without ray queries",
            ),
        ),
        default="auto",
    )
    device: StringProperty(
        name="Device",
        description="Name of the device this scene renders on; empty: the one chosen in the preferences",
        default="",
    )
    samples: IntProperty(name="Samples", description="Samples a pixel", min=1, soft_max=4096, default=128)
    preview_samples: IntProperty(
        name="Viewport Samples", description="Samples a pixel in the viewport; 0: no end", min=0, default=1024
    )
    use_preview_history: BoolProperty(
        name="Carry Pictures On",
        description="Average a viewport's picture with the last one, where it shows the same surfaces in the same "
        "light: less noise while scrubbing and orbiting, for light that may lag behind by its noise. A picture that "
        "has all its samples has nothing of another in it",
        default=True,
    )
    preview_pause: BoolProperty(name="Pause", description="Pause rendering in viewports", default=False)
    time_limit: FloatProperty(
        name="Time Limit", description="Stop after this time; 0: none", min=0.0, default=0.0, unit="TIME_ABSOLUTE"
    )
    use_adaptive_sampling: BoolProperty(
        name="Use Adaptive Sampling",
        description="Give pixels of little noise fewer samples than others, and end early where all are below the "
        "threshold. The picture stays unbiased, but a region of it is not made of the same samples as the whole",
        default=False,
    )
    adaptive_threshold: FloatProperty(
        name="Noise Threshold",
        description="Error, relative to the brightness around, below which a picture is done. Zero: only Samples and "
        "Time Limit end it",
        min=0.0,
        max=1.0,
        soft_min=0.001,
        default=0.01,
        precision=4,
    )
    adaptive_min_samples: IntProperty(
        name="Min Samples",
        description="Samples before the threshold counts; 0: as many as it takes to know the noise",
        min=0,
        max=4096,
        default=0,
    )
    seed: IntProperty(name="Seed", description="Same seed, same noise", min=0, default=0)
    use_animated_seed: BoolProperty(name="Animate Seed", description="Another noise every frame", default=False)
    use_denoising: BoolProperty(
        name="Denoise", description="Denoise the rendered picture", default=False, update=_passes_changed
    )
    denoising_input_passes: EnumProperty(
        name="Passes",
        description="What the denoiser tells noise from detail by",
        items=_INPUT_PASSES,
        default="RGB_ALBEDO_NORMAL",
    )
    denoising_prefilter: EnumProperty(
        name="Prefilter",
        description="What is done about noise in albedo and normal",
        items=_PREFILTERS,
        default="ACCURATE",
    )
    denoising_quality: EnumProperty(
        name="Quality", description="Quality or speed of denoising", items=_QUALITIES, default="HIGH"
    )
    use_preview_denoising: BoolProperty(name="Denoise", description="Denoise pictures of viewports", default=False)
    preview_denoising_input_passes: EnumProperty(
        name="Passes",
        description="What the denoiser tells noise from detail by",
        items=_INPUT_PASSES,
        default="RGB_ALBEDO",
    )
    preview_denoising_prefilter: EnumProperty(
        name="Prefilter",
        description="What is done about noise in albedo and normal",
        items=_PREFILTERS,
        default="FAST",
    )
    preview_denoising_quality: EnumProperty(
        name="Quality", description="Quality or speed of denoising", items=_QUALITIES, default="BALANCED"
    )
    preview_denoising_start_sample: IntProperty(
        name="Start Sample", description="First sample that is denoised", min=0, default=1
    )
    max_bounces: IntProperty(
        name="Total", description="Bounces of a light path; 0: direct light only", min=0, max=1024, default=12
    )
    diffuse_bounces: IntProperty(name="Diffuse", description="Diffuse bounces", min=0, max=1024, default=4)
    glossy_bounces: IntProperty(name="Glossy", description="Glossy bounces", min=0, max=1024, default=4)
    transmission_bounces: IntProperty(
        name="Transmission", description="Transmission bounces", min=0, max=1024, default=12
    )
    transparent_bounces: IntProperty(
        name="Transparent", description="Transparent surfaces a path passes", min=0, max=1024, default=8
    )
    min_bounces: IntProperty(
        name="Min Light Bounces",
        description="Bounces before paths may end by Russian roulette",
        min=0,
        max=1024,
        default=0,
    )
    clamp_direct: FloatProperty(
        name="Direct Light", description="Largest direct sample; 0: no clamping", min=0.0, default=0.0
    )
    clamp_indirect: FloatProperty(
        name="Indirect Light", description="Largest indirect sample; 0: no clamping", min=0.0, default=10.0
    )
    filter_glossy: FloatProperty(
        name="Filter Glossy",
        description="Blur glossy reflections after blurry bounces: less noise, lost caustics",
        min=0.0,
        max=10.0,
        default=1.0,
    )
    caustics_reflective: BoolProperty(name="Reflective", description="Reflective caustics", default=True)
    caustics_refractive: BoolProperty(name="Refractive", description="Refractive caustics", default=True)
    exposure: FloatProperty(name="Exposure", description="Brightness of the film", min=0.0, soft_max=10.0, default=1.0)
    transparent_glass: BoolProperty(
        name="Transparent Glass", description="Transmissive surfaces show the background's alpha", default=False
    )
    filter_type: EnumProperty(
        name="Filter",
        description="Pixel filter",
        items=(
            ("BOX", "Box", "One pixel, no blur"),
            ("GAUSSIAN", "Gaussian", "Soft"),
            ("BLACKMAN_HARRIS", "Blackman-Harris", "Soft and sharp alike"),
        ),
        default="BLACKMAN_HARRIS",
    )
    filter_width: FloatProperty(
        name="Width", description="Width of the pixel filter", min=0.01, max=10.0, default=1.5, subtype="PIXEL"
    )


# Parameters of each integrator that reuses light samples, under its name.
HeadwaterSceneSettings.__annotations__ |= {
    name: PointerProperty(type=group) for name, group in reuse_properties.groups.items()
}


class HeadwaterViewLayerSettings(bpy.types.PropertyGroup):
    use_pass_denoising: BoolProperty(
        name="Denoising Data", description="Store the albedo and normal that denoisers need", default=False
    )


class HeadwaterLightSettings(bpy.types.PropertyGroup):
    use_mis: BoolProperty(
        name="Multiple Importance",
        description="Let rays that bounce into the light find it too: less noise in sharp reflections",
        default=True,
    )


class HeadwaterMaterialSettings(bpy.types.PropertyGroup):
    emission_sampling: EnumProperty(
        name="Emission Sampling",
        description="How the emission of surfaces with this material is found",
        items=(
            ("NONE", "None", "Only by rays that bounce into it"),
            ("AUTO", "Auto", "As a light, where it is bright enough"),
            ("FRONT", "Front", "As a light on the front faces"),
            ("BACK", "Back", "As a light on the back faces"),
            ("FRONT_BACK", "Front and Back", "As a light on both faces"),
        ),
        default="AUTO",
    )


class HeadwaterWorldSettings(bpy.types.PropertyGroup):
    sampling_method: EnumProperty(
        name="Sampling",
        description="How the light of the world is sampled",
        items=(
            ("NONE", "None", "Only by rays that miss everything"),
            ("AUTOMATIC", "Auto", "By an importance map of fitting size"),
            ("MANUAL", "Manual", "By an importance map of the size given"),
        ),
        default="AUTOMATIC",
    )
    sample_map_resolution: IntProperty(
        name="Map Resolution", description="Width of the importance map", min=4, max=8192, default=1024, subtype="PIXEL"
    )
    camera: BoolProperty(name="Camera", description="Camera rays see the world", default=True)
    diffuse: BoolProperty(name="Diffuse", description="Diffuse rays see the world", default=True)
    glossy: BoolProperty(name="Glossy", description="Glossy rays see the world", default=True)
    transmission: BoolProperty(name="Transmission", description="Transmission rays see the world", default=True)


_groups = (
    (bpy.types.Scene, HeadwaterSceneSettings),
    (bpy.types.ViewLayer, HeadwaterViewLayerSettings),
    (bpy.types.Light, HeadwaterLightSettings),
    (bpy.types.Material, HeadwaterMaterialSettings),
    (bpy.types.World, HeadwaterWorldSettings),
)


def register():
    reuse_properties.register()
    for owner, group in _groups:
        bpy.utils.register_class(group)
        owner.headwater = PointerProperty(name="Headwater", type=group)


def unregister():
    for owner, group in reversed(_groups):
        del owner.headwater
        bpy.utils.unregister_class(group)
    reuse_properties.unregister()

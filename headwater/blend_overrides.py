# SPDX-License-Identifier: Apache-2.0
"""The command line's wishes as settings of an opened Blender scene, for Headwater and for Cycles alike."""

from headwater.core import load
from headwater.errors import EXIT_USAGE, UserError
from headwater.integrators import INTEGRATORS, PARAMETERS
from headwater.render_request import BOUNCES
from headwater.render_reuse import check

# pass -> the view layer's switch; Combined is always there
PASS_SWITCHES = {
    "Depth": "use_pass_z",
    "Mist": "use_pass_mist",
    "Position": "use_pass_position",
    "Normal": "use_pass_normal",
    "Vector": "use_pass_vector",
    "UV": "use_pass_uv",
    "Object Index": "use_pass_object_index",
    "Material Index": "use_pass_material_index",
    "Diffuse Direct": "use_pass_diffuse_direct",
    "Diffuse Indirect": "use_pass_diffuse_indirect",
    "Diffuse Color": "use_pass_diffuse_color",
    "Glossy Direct": "use_pass_glossy_direct",
    "Glossy Indirect": "use_pass_glossy_indirect",
    "Glossy Color": "use_pass_glossy_color",
    "Transmission Direct": "use_pass_transmission_direct",
    "Transmission Indirect": "use_pass_transmission_indirect",
    "Transmission Color": "use_pass_transmission_color",
    "Emission": "use_pass_emit",
    "Environment": "use_pass_environment",
}
DENOISING = ("Denoising Normal", "Denoising Albedo", "Denoising Depth")


def apply(scene, request) -> None:
    """Changes `scene` (in memory only) to what the request says. Raises UserError for what it can't be."""
    render = scene.render
    render.engine = "CYCLES" if request.engine == "cycles" else "HEADWATER"
    if request.size:
        render.resolution_x, render.resolution_y = request.size
        render.resolution_percentage = 100
    _region(render, request)
    _camera(scene, request)
    _sampling(scene, request)
    if request.threads:
        render.threads_mode, render.threads = "FIXED", request.threads
    if request.passes is not None:
        for layer in scene.view_layers:
            _passes(layer, request.passes)
    # Frames are rendered one by one: what can be kept from one to the next is kept.
    render.use_persistent_data = request.frames is not None and len(request.frames) > 1
    render.use_overwrite, render.use_placeholder, render.use_file_extension = True, False, False
    _image_format(scene, request)


def _region(render, request):
    scale = render.resolution_percentage / 100
    width, height = max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))
    region = request.check_region(width, height)
    if region is None:
        return
    # Blender cuts borders down to whole pixels: a quarter pixel more survives its single precision.
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = (region[0] + 0.25) / width, min(1.0, (region[2] + 0.25) / width)
    render.border_min_y, render.border_max_y = (region[1] + 0.25) / height, min(1.0, (region[3] + 0.25) / height)


def _camera(scene, request):
    if request.camera is None:
        return
    found = scene.objects.get(request.camera)
    if found is None or found.type != "CAMERA":
        names = ", ".join(o.name for o in scene.objects if o.type == "CAMERA") or "none"
        raise UserError(f"no camera '{request.camera}' in the scene; it has: {names}", EXIT_USAGE)
    scene.camera = found
    for marker in scene.timeline_markers:
        marker.camera = None  # markers bound to cameras would take over again


def _sampling(scene, request):
    """Sets Headwater's own property and Cycles', since the add-on reads either."""
    groups = [
        group for group in (getattr(scene, "headwater", None), getattr(scene, "cycles", None)) if group is not None
    ]

    def put(value, *names):
        for group in groups:
            for name in names:
                if hasattr(group, name):
                    setattr(group, name, value)

    if request.samples is not None or request.time_limit is not None:
        put(request.samples or 1 << 16, "samples")
        put(False, "use_sample_subset")
        put("IGNORE", "use_layer_samples")
    if request.time_limit is not None:
        put(request.time_limit, "time_limit")
    if request.adaptive is not None:
        put(request.adaptive["adaptive_sampling"], "use_adaptive_sampling")
        put(request.adaptive["noise_threshold"], "adaptive_threshold")
    if request.seed is not None:
        put(request.seed, "seed")
        put(False, "use_animated_seed")
    for _, setting, theirs in BOUNCES:
        if setting in request.bounces:
            put(request.bounces[setting], setting)
            if theirs != setting:
                put(request.bounces[setting], theirs)
    if request.no_clamp or request.engine == "cycles":
        put(0.0, "clamp_direct", "clamp_indirect", "sample_clamp_direct", "sample_clamp_indirect")
    put(request.denoise, "use_denoising")  # the file does not decide: numbers are compared with noisy pictures
    if request.engine == "cycles":
        if request.adaptive is None:
            put(False, "use_adaptive_sampling")
        scene.cycles.device = "CPU"
    else:
        own = scene.headwater
        if request.lights is not None:
            own.light_choice = request.lights
        _reuse(own, request)


def _reuse(own, request):
    """The integrator and its parameters. The core checks them here: Blender would clip a value that is out of range."""
    if request.integrator is not None:
        own.integrator = request.integrator
    estimator = own.estimator if request.estimator is None else request.estimator
    check(load(), own.integrator, estimator, request.reuse)
    own.estimator = estimator
    group = INTEGRATORS[own.integrator].group(estimator)
    for name, value in request.reuse.items():
        setattr(getattr(own, group), name, PARAMETERS[name].to_property(value))


def _passes(layer, wanted):
    for name, switch in PASS_SWITCHES.items():
        setattr(layer, switch, name in wanted)
    denoising = any(name in DENOISING for name in wanted)
    for group, name in (("cycles", "denoising_store_passes"), ("headwater", "use_pass_denoising")):
        if hasattr(layer, group):
            setattr(getattr(layer, group), name, denoising)


def has_only_combined(scene) -> bool:
    """Whether the scene renders one view layer with no pass but Combined."""
    layers = [layer for layer in scene.view_layers if layer.use]
    if len(layers) != 1 or scene.render.use_multiview:
        return False
    layer = layers[0]
    # Cryptomatte's accuracy is a setting among the switches, on by default: it asks for no pass.
    not_a_pass = ("use_pass_combined", "use_pass_cryptomatte_accurate")
    switches = [name for name in dir(layer) if name.startswith("use_pass_") and name not in not_a_pass]
    extra = any(getattr(layer, name) for name in switches) or len(layer.aovs) or len(layer.lightgroups)
    denoising = getattr(getattr(layer, "cycles", None), "denoising_store_passes", False)
    own = getattr(getattr(layer, "headwater", None), "use_pass_denoising", False)
    return not (extra or denoising or own or denoised(scene))


def denoised(scene) -> bool:
    """Whether the scene's pictures are denoised, so that the noisy ones are a pass of their own."""
    return any(getattr(getattr(scene, group, None), "use_denoising", False) for group in ("headwater", "cycles"))


def _image_format(scene, request):
    settings = scene.render.image_settings
    multilayer = not request.is_png and not has_only_combined(scene)
    if hasattr(settings, "media_type"):  # Blender 5.0
        settings.media_type = "MULTI_LAYER_IMAGE" if multilayer else "IMAGE"
    if request.is_png:
        settings.file_format, settings.color_depth = "PNG", "8"
        settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
        return
    settings.file_format = "OPEN_EXR_MULTILAYER" if multilayer else "OPEN_EXR"
    settings.color_depth = "16" if request.exr_depth == "half" else "32"
    if not multilayer:
        settings.color_mode = "RGBA"
    settings.exr_codec = "ZIP"
    if hasattr(settings, "color_management"):
        settings.color_management = "FOLLOW_SCENE"

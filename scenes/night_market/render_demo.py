# SPDX-License-Identifier: Apache-2.0
"""Renders the night market through Blender with Headwater: PNG frames, a multilayer EXR, an animated WebP, an MP4.

    .venv/bin/python scenes/night_market/render_demo.py [--frames 48] [--size 384x216] [--samples 2] [-o out/demo]

The scene is made anew, rendered as a user would (`bpy.ops.render.render(animation=True)`), and cleaned up after each
frame by Blender's own compositor: Open Image Denoise on Headwater's albedo and normal passes, and a little bloom.
--no-finish shows the render as it comes. Exit status 0 only when every frame was written.
"""

import argparse
import ctypes
import json
import os
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT)]

import bpy  # noqa: E402
import make_night_market  # noqa: E402
import numpy as np  # noqa: E402

from headwater.quiet import captured_output  # noqa: E402


def set_up(options):
    """Engine and quick settings; the finishing compositor unless refused."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.render.engine = options.engine
    scene.render.use_persistent_data = True
    for name in ("use_pass_z", "use_pass_normal", "use_pass_diffuse_color", "use_pass_emit", "use_pass_vector"):
        setattr(layer, name, True)
    if options.engine == "HEADWATER":
        settings = scene.headwater
        settings.use_cycles_settings = False
        settings.samples, settings.max_bounces = options.samples, options.bounces
        settings.clamp_indirect, settings.use_animated_seed = 4.0, True
        settings.clamp_direct = 24.0
        settings.wssr_hash.bounce_samples = 1  # edges are worth more here than reflections, and the time is short
        settings.device = options.device
        layer.headwater.use_pass_denoising = True
    else:
        settings = scene.cycles
        settings.samples, settings.max_bounces = options.samples, options.bounces
        settings.use_adaptive_sampling = settings.use_denoising = False
        settings.sample_clamp_indirect, settings.use_animated_seed = 4.0, True
        layer.cycles.denoising_store_passes = True
    if not options.no_finish:
        finish(scene, layer)


def finish(scene, layer):
    """Compositor: denoise by albedo and normal, then bloom."""
    tree = bpy.data.node_groups.new("Finish", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    scene.compositing_node_group = tree
    layer.update_render_passes()
    source, denoise, glare, leave = (
        tree.nodes.new(kind)
        for kind in ("CompositorNodeRLayers", "CompositorNodeDenoise", "CompositorNodeGlare", "NodeGroupOutput")
    )
    tree.links.new(source.outputs["Image"], denoise.inputs["Image"])
    for name in ("Albedo", "Normal"):
        output = source.outputs.get(f"Denoising {name}")
        if output is None:
            raise RuntimeError(f"the engine offers no pass Denoising {name}")
        tree.links.new(output, denoise.inputs[name])
    denoise.inputs["Quality"].default_value = "Balanced"  # High takes as long as the render and shows no more
    for name, value in (("Type", "Bloom"), ("Threshold", 1.2), ("Strength", 0.28), ("Size", 0.45), ("Maximum", 12.0)):
        glare.inputs[name].default_value = value
    glare.inputs["Clamp"].default_value = True
    tree.links.new(denoise.outputs["Image"], glare.inputs["Image"])
    tree.links.new(glare.outputs["Image"], leave.inputs[0])
    scene.render.use_compositing = True


def render_frames(options, folder):
    """Renders the animation; returns the paths of the frames. Raises RuntimeError when a frame is missing or black."""
    scene = bpy.context.scene
    picture = scene.render.image_settings
    picture.media_type, picture.file_format, picture.color_mode = "IMAGE", "PNG", "RGB"
    for old in folder.glob("frame_*.png"):
        old.unlink()
    scene.render.filepath = str(folder / "frame_####.png")
    scene.render.use_file_extension = True
    started = time.perf_counter()
    total = scene.frame_end - scene.frame_start + 1
    done = []

    def progress(*_):
        done.append(time.perf_counter() - started)
        left = done[-1] / len(done) * (total - len(done))
        last = done[-1] - (done[-2] if len(done) > 1 else 0.0)
        line = f"frame {len(done)}/{total}: {last:.1f} s, about {left:.0f} s left"
        print(f"\r{line:<60}" if sys.stdout.isatty() else line, end="" if sys.stdout.isatty() else "\n", flush=True)

    bpy.app.handlers.render_write.append(progress)
    try:
        with captured_output() as printed:
            bpy.ops.render.render(animation=True)
            text = printed()
    finally:
        bpy.app.handlers.render_write.remove(progress)
    if sys.stdout.isatty():
        print()
    paths = [folder / f"frame_{number:04d}.png" for number in range(scene.frame_start, scene.frame_end + 1)]
    missing = [path.name for path in paths if not path.is_file()]
    if missing:
        raise RuntimeError(f"{len(missing)} frames were not written, {missing[0]} first; Blender said:\n{text[-4000:]}")
    return paths, done


def write_exr(path):
    """The last frame with all its passes."""
    picture = bpy.context.scene.render.image_settings
    picture.media_type, picture.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
    picture.color_depth, picture.exr_codec = "16", "ZIP"
    bpy.data.images["Render Result"].save_render(str(path), scene=bpy.context.scene)


def write_webp(frames, path, fps):
    """An animated picture that browsers play, from (H, W, 3) frames."""
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 / fps), loop=0, quality=80, method=2
    )


def write_mp4(paths, path, size, fps):
    """The frames as H.264, by Blender's own FFmpeg, in a scene of its own."""
    scene = bpy.data.scenes.new("Movie")
    editor = scene.sequence_editor_create()
    strip = editor.strips.new_image("Frames", str(paths[0]), 1, 1)
    for frame in paths[1:]:
        strip.elements.append(frame.name)
    scene.frame_start, scene.frame_end = 1, len(paths)
    scene.view_settings.view_transform = "Standard"
    render = scene.render
    render.resolution_x, render.resolution_y, render.fps = size[0] // 2 * 2, size[1] // 2 * 2, fps
    render.resolution_percentage = 100
    render.image_settings.media_type, render.image_settings.file_format = "VIDEO", "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec = "MPEG4", "H264"
    render.ffmpeg.constant_rate_factor = "HIGH"
    render.filepath = str(path)
    with captured_output():
        bpy.ops.render.render(animation=True, scene=scene.name)
    bpy.data.scenes.remove(scene)


def main():
    parser = argparse.ArgumentParser(prog="./dev demo", description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "out" / "demo", help="folder (default: out/demo)")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--lights", type=int, default=700)
    parser.add_argument("--size", type=make_night_market.size, default=(384, 216), metavar="WxH")
    parser.add_argument("--samples", type=int, default=2, help="samples a pixel (default: 2)")
    parser.add_argument("--bounces", type=int, default=2, help="bounces of a light path (default: 2)")
    parser.add_argument("--device", default="", help="name of the Vulkan device (default: the best)")
    parser.add_argument("--engine", choices=("HEADWATER", "CYCLES"), default="HEADWATER", help="CYCLES: for comparison")
    parser.add_argument("--no-finish", action="store_true", help="neither denoising nor bloom")
    options = parser.parse_args()
    if options.frames < 1 or options.samples < 1 or options.bounces < 0:
        parser.error("--frames and --samples must be 1 or more, --bounces 0 or more")
    folder = options.output.resolve()
    folder.mkdir(parents=True, exist_ok=True)

    if options.engine == "HEADWATER":
        import headwater.blender

        (folder / "stats.jsonl").unlink(missing_ok=True)
        sys.argv[1:] = ["--", "--headwater-stats", str(folder / "stats.jsonl")]  # as after `blender -b FILE -a --`
        headwater.blender.register()
    with captured_output():
        report = make_night_market.make(options.lights, options.frames, options.size)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "night_market.blend"), compress=True)
        ctypes.CDLL(None).fflush(None)  # what Blender printed goes with the rest, not on the terminal later
    print(f"night market: {report['lights']} lights, {report['objects']} objects, made in {report['seconds']} s")
    set_up(options)
    try:
        paths, times = render_frames(options, folder)
        with captured_output():
            write_exr(folder / "last_frame.exr")
        from PIL import Image

        frames = [Image.open(path).convert("RGB") for path in paths]
        if max(np.asarray(frame).mean() for frame in frames) < 1.0:
            raise RuntimeError("the frames are black")
        fps = bpy.context.scene.render.fps
        write_webp(frames, folder / "night_market.webp", fps)
        if bpy.app.ffmpeg.supported and len(paths) > 1:
            write_mp4(paths, folder / "night_market.mp4", options.size, fps)
    except RuntimeError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    stats = {
        "engine": options.engine,
        "size": options.size,
        "samples": options.samples,
        "lights": report["lights"],
        "seconds": round(times[-1], 2),
        "frame_seconds": [round(b - a, 3) for a, b in zip([0, *times], times)],
    }
    (folder / "demo.json").write_text(json.dumps(stats, indent=1) + "\n")
    print(f"{len(paths)} frames in {times[-1]:.0f} s")
    for name in ("frame_0001.png", "last_frame.exr", "night_market.webp", "night_market.mp4", "night_market.blend"):
        if (folder / name).is_file():
            print(f"  {folder / name}")
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # some builds of bpy crash while they tear down after a render; all files are written by now

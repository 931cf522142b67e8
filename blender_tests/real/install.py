#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The extension's life in a real Blender: install, render, denoise, no device, farm guard, off and on, uninstall.

  install.py LAUNCHER ZIP FOLDER

LAUNCHER runs Blender with the arguments it is given and takes its home from BL_HOME. FOLDER is emptied; pictures and
logs stay in it. Status 1 and one line where something is not as it should be.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

GUARD = Path(__file__).resolve().parents[2] / "addon" / "headwater" / "farm_guard.py"
ID = "bl_ext.user_default.headwater"
SCENE = """
import bpy
scene = bpy.context.scene
scene.render.engine = "HEADWATER"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
scene.headwater.use_cycles_settings, scene.headwater.samples = False, 4
scene.render.image_settings.file_format = "PNG"
scene.frame_end = 1
bpy.ops.wm.save_as_mainfile(filepath={file!r})
"""
# A picture denoised by the package's own library, no other having been loaded for it.
DENOISE = """
import bpy, re
scene = bpy.context.scene
before = open("/proc/self/maps").read()
scene.headwater.use_denoising = True
scene.render.filepath = {picture!r}
bpy.ops.render.render(write_still=True)
libraries = set(re.findall(r"/\\S*(?:oidn|OpenImageDenoise)\\S*[.]so\\S*", open("/proc/self/maps").read()))
new = {{library for library in libraries if library not in before}}
assert len(new) == 4 and all("/site-packages/headwater/oidn/lib/" in library for library in new), new
"""
TOGGLE = """
import addon_utils, bpy
for _ in range(3):
    addon_utils.disable({id!r}, default_set=True)
    assert not hasattr(bpy.types.Scene, "headwater")
    addon_utils.enable({id!r}, default_set=True)
    assert hasattr(bpy.types.Scene, "headwater")
"""


class Session:
    """Blender of one launcher in a profile of its own."""

    def __init__(self, launcher, folder: Path):
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "home").mkdir(parents=True)
        self.launcher, self.folder, self.home, self.step = launcher, folder, folder / "home", 0

    def blender(self, *arguments, status=0, says="", environment=()) -> str:
        """Runs Blender, keeps its log, exits when status or text differ from what is expected."""
        self.step += 1
        command = [self.launcher]
        if environment:
            command += ["--sh", "env", *environment, "blender"]
        done = subprocess.run(
            [*command, *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=300,
            env=dict(os.environ, BL_HOME=str(self.home)),
        )
        (self.folder / f"{self.step:02}.log").write_text(done.stdout)
        self.expect(done.returncode == status, f"{arguments}: status {done.returncode}, not {status}")
        self.expect(says in done.stdout, f"{arguments}: does not say {says!r}")
        return done.stdout

    def expect(self, condition, text: str) -> None:
        if not condition:
            sys.exit(f"install: {text} (logs in {self.folder})")

    def script(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.write_text(text)
        return path

    def left(self) -> list[str]:
        """What of ours lies in the profile: by its name, or in folders that extensions alone fill."""
        found = {path for path in self.home.rglob("*") if "headwater" in path.name.lower()}
        for folder in ("site-packages", "extensions/.user"):  # of wheels; of bpy.utils.extension_path_user
            found.update(path for place in self.home.rglob(folder) for path in place.rglob("*") if path.is_file())
        return sorted(str(path.relative_to(self.home)) for path in found)


def main(launcher: str, zip_path: str, folder: str) -> None:
    session = Session(launcher, Path(folder).resolve())
    install = ("--command", "extension", "install-file", "-r", "user_default", "-e", Path(zip_path).resolve())
    file, picture = session.folder / "scene.blend", session.folder / "frame_"
    animation = ("-o", f"{picture}####", "-a")
    no_device = ("VK_ICD_FILENAMES=/nonexistent", "VK_DRIVER_FILES=/nonexistent")
    code = ("-b", "--python-exit-code", "3")

    session.blender("--command", "extension", "validate", install[-1], says="Success")
    session.blender(*install, says="Installed", environment=no_device)  # enabling needs no device
    session.expect(any("site-packages" in p for p in session.left()), "the wheel was not unpacked")
    session.blender(*code, "--python", session.script("scene.py", SCENE.format(file=str(file))))
    for tracer in ("embree", "ray_query"):
        session.blender("-b", file, *animation, "--", "--headwater-tracer", tracer)
        written = Path(f"{picture}0001.png")
        session.expect(written.is_file() and written.stat().st_size > 1000, f"no picture by {tracer}")
        written.replace(session.folder / f"{tracer}.png")
    denoised = session.folder / "denoised.png"
    denoise = session.script("denoise.py", DENOISE.format(picture=str(denoised)))
    said = session.blender("-b", file, "--python-exit-code", "3", "--python", denoise)
    session.expect(denoised.is_file() and "not denoised" not in said, "no denoised picture")
    session.blender("-b", file, *animation, status=1, says="mesa-vulkan-drivers", environment=no_device)
    session.blender("-b", file, "-P", GUARD, *animation)
    session.blender("-b", file, "-P", GUARD, *animation, status=3, says="no Vulkan driver", environment=no_device)
    session.blender("-b", "--factory-startup", file, "-P", GUARD, *animation, status=3, says="not installed")
    session.blender(*code, "--python", session.script("toggle.py", TOGGLE.format(id=ID)))
    session.blender(*install, says="nstalled")  # once more over itself
    session.blender("-b", file, *animation)
    session.blender("--command", "extension", "remove", "headwater")
    session.blender("-b", "--python-expr", "pass")  # Blender clears wheels away when it starts
    session.expect(not session.left(), f"left behind: {session.left()}")
    print(f"install: passed in {Path(launcher).name}")


if __name__ == "__main__":
    main(*sys.argv[1:])

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Updates of the extension in a real Blender: between two starts, and while Blender runs with the old one loaded.

  update.py LAUNCHER ZIP FOLDER

As install.py, whose sessions it uses. The new version is the zip itself under a higher number.
"""

import re
import sys
import zipfile
from pathlib import Path

from install import ID, SCENE, Session

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import package_extension as packing  # noqa: E402

# Renders with the old version, installs the new one, and looks at what preferences and a render say then.
IN_SESSION = """
import addon_utils, bpy, sys

class Layout:
    '''Takes what a panel draws, and keeps its words.'''
    words = []
    def label(self, text="", **_): self.words.append(text)
    def column(self): return self
    box = row = column
    def prop(self, *_, **__): self.words.append("a setting")
    operator = prop

def preferences():
    Layout.words = []
    sys.modules[{id!r} + ".preferences"].HeadwaterPreferences.draw(type("Own", (), dict(layout=Layout())), None)
    return " ".join(Layout.words)

if {loaded}:
    bpy.ops.render.render()
    assert "restart Blender" not in preferences(), preferences()
assert bpy.ops.extensions.package_install_files(
    filepath={zip!r}, repo="user_default", enable_on_install=True) == {{"FINISHED"}}
assert "updated" in preferences() and "restart Blender" in preferences(), preferences()
assert "a setting" not in preferences()
try:
    bpy.ops.render.render()
except RuntimeError as error:
    assert "restart Blender" in str(error), error
else:
    raise AssertionError("a render by a stale package")
for _ in range(2):
    addon_utils.disable({id!r}, default_set=True)
    addon_utils.enable({id!r}, default_set=True)
assert hasattr(bpy.types.Scene, "headwater")
print("update: as it should be")
"""


def bumped(extension: Path, folder: Path) -> Path:
    """The extension under the next number, as a zip in `folder`."""
    old = packing.version_of_sources()
    new = re.sub(r"\d+$", lambda last: str(int(last[0]) + 1), old)
    with zipfile.ZipFile(extension) as archive:
        files = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    (wheel,) = (name for name in files if name.endswith(".whl"))
    (folder / "old.whl").write_bytes(files.pop(wheel))
    with zipfile.ZipFile(folder / "old.whl") as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    build = contents["headwater/build.txt"].decode().replace(old, new, 1)
    information = [name for name in contents if ".dist-info/" in name]
    licences = {Path(name).name: contents[name] for name in information if "/licenses/" in name}
    for name in information:
        del contents[name]
    contents["headwater/build.txt"] = build.encode()
    made = packing.write_wheel(folder, build, contents, licences)
    manifest = files["blender_manifest.toml"].decode()
    manifest = manifest.replace(f'version = "{old}"', f'version = "{new}"', 1).replace(Path(wheel).name, made.name)
    files |= {"blender_manifest.toml": manifest.encode(), f"wheels/{made.name}": made.read_bytes()}
    result = folder / f"headwater-{new}.zip"
    with zipfile.ZipFile(result, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return result


def expect_only(session: Session, extension: Path) -> None:
    """Of two versions, the profile has this one alone: add-on, wheel and package."""
    with zipfile.ZipFile(extension) as archive:
        (wheel,) = (name for name in archive.namelist() if name.endswith(".whl"))
    build = Path(wheel).name.split("-")[1]
    found = sorted(path.name for path in session.home.rglob("headwater-*.dist-info"))
    session.expect(found == [f"headwater-{build}.dist-info"], f"site-packages has {found}, not only {build}")
    found = sorted(path.name for path in session.home.rglob("user_default/headwater/wheels/*"))
    session.expect(found == [Path(wheel).name], f"the add-on has {found}")
    (on_disk,) = session.home.rglob("site-packages/headwater/build.txt")
    session.expect(on_disk.read_text() == build, f"build {on_disk.read_text()} on disk, not {build}")


def main(launcher: str, zip_path: str, folder: str) -> None:
    old, folder = Path(zip_path).resolve(), Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    new = bumped(old, folder)
    install = ("--command", "extension", "install-file", "-r", "user_default", "-e")
    code = ("-b", "--python-exit-code", "3")
    for name in ("between", "unloaded", "loaded"):
        session = Session(launcher, folder / name)
        file = session.folder / "scene.blend"
        render = ("-b", file, "-o", session.folder / "frame_####", "-a")
        session.blender(*install, old, says="nstalled")
        expect_only(session, old)
        session.blender(*code, "--python", session.script("scene.py", SCENE.format(file=str(file))))
        if name == "between":
            session.blender(*render)
            session.blender(*install, new, says="nstalled")
        else:  # in a running Blender that has, or has not yet, loaded the core
            script = IN_SESSION.format(id=ID, zip=str(new), loaded=name == "loaded")
            arguments = ("-b", file, "--python-exit-code", "3", "-P", session.script("update.py", script))
            session.blender(*arguments, status=1, says="as it should be")  # 1: a frame failed
        session.blender(*render)
        session.expect((session.folder / "frame_0001.png").is_file(), f"no picture after the update ({name})")
        expect_only(session, new)
        session.blender("--command", "extension", "remove", "headwater")
        session.blender("-b", "--python-expr", "pass")  # Blender clears wheels away when it starts
        session.expect(not session.left(), f"left behind: {session.left()}")
    print(f"update: passed in {Path(launcher).name}")


if __name__ == "__main__":
    main(*sys.argv[1:])

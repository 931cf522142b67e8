#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks every tracked or new file: licence header, no machine path or package host, no large file, a safe GIL.

python3 tools/check_tree.py      # prints PATH:LINE: complaint; exit status 1 when there is one
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE_SUFFIXES = {".py", ".cpp", ".h", ".hpp", ".sh", ".cmake", ".toml", ".yaml", ".yml"}
SOURCE_SUFFIXES |= {".glsl", ".comp", ".rgen", ".rmiss", ".rchit", ".rint"}
SOURCE_NAMES = {"dev", "run", "CMakeLists.txt"}
HEADER_LINES = 5  # a "#!" line and an encoding line may come first
ADDON_LICENCE, LICENCE = "GPL-3.0-or-later", "Apache-2.0"
LARGE_BYTES = 2_000_000

# Absolute paths of somebody's machine and hosts that packages come from. A system's own places (/usr, /etc, /tmp in an
# example) are no machine's secret and are not listed.
STRAY = [
    (re.compile(r"(?<![\w.])/(?:home|root|work|Users|mnt)/[\w.-]+"), "path of one machine"),
    (
        re.compile(
            r"https?://[\w.-]*(?:deb\.debian|pypi\.|pythonhosted|snapshot\.debian|proxy\.golang|registry\.npmjs)"
        ),
        "package host",
    ),
    (re.compile(r"https?://(?:localhost|\d+\.\d+\.\d+\.\d+)"), "host of one machine"),
]
SELF = "tools/check_tree.py"
UNSAFE_GIL = re.compile(r"gil_scoped_\w+")  # abort where the interpreter has ended: core/python/gil.h


def files():
    """Repository-relative paths of tracked files and of untracked files that git does not ignore."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout.decode()
    return sorted(p for p in set(listed.split("\0")) if p and (ROOT / p).is_file())


def licences(path):
    """Licences a file may have: the add-on's for the add-on and, where they import it, for tests; else the core's."""
    if path.startswith("addon/"):
        return [ADDON_LICENCE]
    return [LICENCE, ADDON_LICENCE] if path.startswith("blender_tests/") else [LICENCE]


def complaints(path):
    """Complaints about one file, each as (line, text)."""
    file = ROOT / path
    size = file.stat().st_size
    if size > LARGE_BYTES:
        yield 1, f"{size / 1e6:.1f} MB: too large for the repository (limit {LARGE_BYTES / 1e6:.0f} MB)"
        return
    data = file.read_bytes()
    if b"\0" in data[:4096]:
        return
    try:
        lines = data.decode().splitlines()
    except UnicodeDecodeError:
        yield 1, "not UTF-8"
        return
    if file.suffix in SOURCE_SUFFIXES or file.name in SOURCE_NAMES:
        head = "\n".join(lines[:HEADER_LINES])
        if lines and not any(f"SPDX-License-Identifier: {name}" in head for name in licences(path)):
            wanted = " or ".join(licences(path))
            yield 1, f'no "SPDX-License-Identifier: {wanted}" in the first {HEADER_LINES} lines'
    if path == SELF or path.startswith("LICENSES/"):
        return
    for number, line in enumerate(lines, 1):
        for pattern, what in STRAY:
            found = pattern.search(line)
            if found:
                yield number, f"{what}: {found.group(0)}"
        if path.startswith("core/") and UNSAFE_GIL.search(line):
            yield number, f"{UNSAFE_GIL.search(line).group(0)}: use WithoutGil and WithGil"
        if re.match(r"(<{7}|>{7}|={7})(\s|$)", line):
            yield number, "merge conflict mark"


def main():
    bad = 0
    for path in files():
        for line, text in complaints(path):
            print(f"{path}:{line}: {text}")
            bad += 1
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""The figures' scenes: made by scenes/figures in a process of its own, once for each version of its scripts."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from headwater.errors import UserError

SCRIPTS = Path(__file__).resolve().parents[2] / "scenes"


@dataclass(frozen=True)
class Scene:
    """A .blend with what its maker says of it (make_figure_scene.py --facts)."""

    name: str
    blend: str
    facts: dict
    digest: str  # of the scripts and arguments that made it


def make_scene(name: str, folder: str, seed: int = 1, lights: int | None = None) -> Scene:
    """The scene's .blend in `folder`, made if it is not there. Raises UserError with the script's last line."""
    script = SCRIPTS / "figures" / "make_figure_scene.py"
    if not script.is_file():
        raise UserError(
            "the figures' scenes are made by scripts of the source checkout (scenes/figures), not found here"
        )
    digest = _digest(name, seed, lights)
    blend = os.path.join(folder, f"{name}-{digest}.blend")
    facts = os.path.splitext(blend)[0] + ".json"
    if not (os.path.isfile(blend) and os.path.isfile(facts)):
        os.makedirs(folder, exist_ok=True)
        draft = os.path.join(folder, f".{name}-{os.getpid()}.blend")
        command = [sys.executable, str(script), name, "-o", draft, "--facts", facts, "--seed", str(seed)]
        if lights is not None:
            command += ["--lights", str(lights)]
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
        if done.returncode != 0 or not os.path.isfile(draft):
            last = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()][-1:]
            raise UserError(f"the scene '{name}' can't be made: {''.join(last) or f'status {done.returncode}'}")
        os.replace(draft, blend)
    with open(facts, encoding="utf-8") as file:
        return Scene(name, blend, json.load(file), digest)


def _digest(name, seed, lights) -> str:
    found = hashlib.sha256(json.dumps([name, seed, lights]).encode())
    for folder in ("figures", "night_market"):
        for path in sorted((SCRIPTS / folder).glob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()[:10]

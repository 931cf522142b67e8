# SPDX-License-Identifier: Apache-2.0
"""One process of `headwater bench-speed`: renders a .blend several times by one engine and writes what each cost.

python -m headwater.bench_speed_worker JOB.json RESULT.json
"""

import json
import os
import sys
import tempfile

from headwater.bench.measured_blend import MeasuredBlend, cpu_seconds, sync_build
from headwater.errors import UserError
from headwater.render_stats import peak_rss_bytes


def _moved_object(scene, name):
    """The object named, else the last mesh of the scene that is rendered."""
    found = scene.objects.get(name) if name else None
    if name and found is None:
        raise UserError(f"no object '{name}' in the scene")
    found = found or next((o for o in reversed(scene.objects) if o.type == "MESH" and not o.hide_render), None)
    if found is None:
        raise UserError("no mesh object to move")
    return found


def _stills(job, blend) -> None:
    """The first picture, then rounds of a render with few samples and one with many."""
    few, many = job["samples"]
    for samples in [few] + [few, many] * job["rounds"]:
        blend.set_samples(samples)
        blend.render()


def _keyframes(job, blend) -> None:
    """An animation of which one object's place is keyed."""
    scene = blend.scene
    moved = _moved_object(scene, job["move"])
    scene.frame_set(scene.frame_start)
    for number in range(job["frames"]):
        moved.location.x += 0.05 * number
        moved.keyframe_insert("location", frame=scene.frame_start + number)
    scene.frame_end = scene.frame_start + job["frames"] - 1
    blend.set_samples(job["samples"][0])
    with tempfile.TemporaryDirectory(prefix="headwater-bench-") as folder:
        scene.render.filepath = os.path.join(folder, "frame####")
        blend.render(animation=True)


def _script(job, blend) -> None:
    """Stills of the same frame between which a script moves one object."""
    moved = _moved_object(blend.scene, job["move"])
    blend.set_samples(job["samples"][0])
    for number in range(job["frames"]):
        moved.location.x += 0.05 * (number > 0)
        blend.render()


def _record(job, frame, facts) -> dict:
    record = {
        "samples": 0,
        "seconds": frame["seconds"],
        "cpu_seconds": frame["cpu_seconds"],
        "sync_build_seconds": sync_build(job["engine"], frame, facts),
        "before_samples_seconds": frame["marks"].get("sample"),
        "blender_seconds": frame["marks"].get("first"),
        "ended_at": frame["ended_at"],
    }
    if facts is not None:
        record |= {"export": facts["export"], "sync": facts["sync"], "core": facts["core"]}
    return record


def main(job_path: str, result_path: str) -> int:
    """Does the job; the result is {"renders": [...], ...} or {"error": text}."""
    with open(job_path, encoding="utf-8") as file:
        job = json.load(file)
    try:
        blend = MeasuredBlend(job)
        before = peak_rss_bytes()
        {"stills": _stills, "keyframes": _keyframes, "script": _script}[job["mode"]](job, blend)
        result = {
            "renders": [_record(job, frame, found) for frame, found in blend.pairs()],
            "peak_rss_bytes": peak_rss_bytes(),
            "rss_before_bytes": before,
            "cpu_seconds": cpu_seconds(),
            "blender": blend.bpy.app.version_string,
        }
        few, many = job["samples"]
        if job["mode"] == "stills":
            counts = [few] + [few, many] * job["rounds"]
        else:
            counts = [few] * len(result["renders"])
        for record, count in zip(result["renders"], counts, strict=True):
            record["samples"] = count
    except (UserError, ImportError, RuntimeError) as error:
        result = {"error": str(error)}
    with open(result_path, "w", encoding="utf-8") as file:
        json.dump(result, file, default=str)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))

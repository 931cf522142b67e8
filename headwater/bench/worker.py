# SPDX-License-Identifier: Apache-2.0
"""The process of `headwater bench` that renders one .blend by one engine, as often as it is asked.

    python -m headwater.bench.worker

The first line on stdin is the job of measured_blend.py; every further one {"contestant", "seed", "samples", "frames",
"output", "lead", "lead_samples"} asks for a render of each frame in order, into the pattern `output`, after those of
`lead`. Each is answered by one line on stdout: {"renders": [...]} with what each frame cost, or {"error"}. "lead" of a
cost is what the frames before it cost: lists of [frame, seconds, seconds of synchronizing and building].
"""

import json
import os
import sys

from headwater.bench.measured_blend import MeasuredBlend, sync_build
from headwater.errors import UserError, first_line
from headwater.integrators import ESTIMATORS, INTEGRATORS
from headwater.output import frame_path


def _cost(engine: str, marks: dict, facts: dict | None) -> dict:
    """Seconds of a picture: all; of sampling alone; of synchronizing and building."""
    if engine == "headwater":
        sampling = facts["render_seconds"]
        extra = {"core": facts["core"], "sync": facts["sync"], "export": facts["export"]}
    else:
        if "sample" not in marks["marks"]:
            raise UserError("Cycles did not say when it began to sample")
        sampling = marks["seconds"] - marks["marks"]["sample"]
        extra = {}
    cost = {
        "seconds": marks["seconds"],
        "sampling_seconds": sampling,
        "sync_build_seconds": sync_build(engine, marks, facts),
        "cpu_seconds": marks["cpu_seconds"],
    }
    return cost | extra


def render(blend: MeasuredBlend, job: dict, question: dict) -> dict:
    """Renders the frames of a question, each into a file of its own."""
    wanted = question["contestant"]
    given = {"samples": question["samples"], "seed": question["seed"]}
    if blend.engine == "headwater":
        given |= {name: wanted[name] for name in ("integrator", "lights", "estimator", "noise_threshold")}
        given["reuse"] = wanted["parameters"]
        _forget(blend.scene.headwater)
    blend.apply(job, **given)
    scene = blend.scene
    if blend.engine == "cycles":
        scene.cycles.use_light_tree = wanted["light_tree"]
    frames, lead = question["frames"], question["lead"]
    order = [*lead, *frames]
    scene.frame_step = order[1] - order[0] if len(order) > 1 else 1
    first = len(blend.clock.frames)
    blend.set_samples(question["lead_samples"] if lead else question["samples"])
    for frame in lead:
        scene.frame_set(frame)
        blend.render()
    blend.set_samples(question["samples"])
    for frame in frames:
        if scene.frame_current != frame:
            scene.frame_set(frame)
        scene.render.filepath = frame_path(question["output"], frame, animated=True)
        blend.render(write_still=True)
        if not os.path.exists(scene.render.filepath):
            raise UserError("the picture could not be written")
    costs = [_cost(blend.engine, marks, facts) for marks, facts in blend.pairs()[first:]]
    before = [[f, c["seconds"], c["sync_build_seconds"]] for f, c in zip(lead, costs[: len(lead)], strict=True)]
    return {"renders": [cost | {"lead": before} for cost in costs[len(lead) :]]}


def _forget(own) -> None:
    """Sets to its default what a contestant may choose: the file, or the last contestant, may have chosen otherwise."""
    for name in ("integrator", "light_choice", "estimator"):
        own.property_unset(name)
    for integrator in INTEGRATORS.values():
        for estimator, _, _ in ESTIMATORS:
            names = integrator.parameters(estimator)
            group = getattr(own, integrator.group(estimator)) if names else None
            for name in names:
                group.property_unset(name)


def main() -> int:
    """Answers until stdin ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # Blender prints to stdout: into the log with it
    blend = job = None
    for line in sys.stdin:
        question = json.loads(line)
        try:
            if blend is None:
                job = question
                blend = MeasuredBlend(job)
                answer = {"blender": blend.bpy.app.version_string, "frame": blend.scene.frame_current}
            else:
                answer = render(blend, job, question)
        except Exception as error:  # whatever it is, the one who asked must hear of it
            if not isinstance(error, UserError):
                print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            answer = {"error": first_line(error).removeprefix("Headwater: ").removeprefix("Error: ")}
        answers.write(json.dumps(answer, default=str) + "\n")
        answers.flush()
    os._exit(0)  # bpy may hang or crash on its way out


if __name__ == "__main__":
    sys.exit(main())

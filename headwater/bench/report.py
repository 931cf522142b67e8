# SPDX-License-Identifier: Apache-2.0
"""The report of `headwater bench`: one HTML page that needs no other file, JSON with every number, a table as text."""

import base64
import html
import json
import os
import tempfile

import numpy as np

from headwater.bench.curves import shown, shown_beyond
from headwater.bench.measure import CPU, SAMPLING, WITH_SYNC, Measured, chosen_reference, disagreement_line
from headwater.bench.plot import COLOURS, log_log
from headwater.figures.display import exposure_of, tone_map
from headwater.image_io import write_png8
from headwater.output import write_text

_PLOTS = ((WITH_SYNC, "with sync and build"), (SAMPLING, "sampling alone"))
_TIMES = (WITH_SYNC, SAMPLING, CPU)
_STYLE = """
body{background:#18181b;color:#e4e4e7;font:15px/1.5 system-ui,sans-serif;margin:2em auto;
max-width:1500px;padding:0 1.5em}
h1,h2{font-weight:600}h2{margin-top:2.2em;border-top:1px solid #3f3f46;padding-top:1em}
.row{display:flex;flex-wrap:wrap;gap:12px}figure{margin:0;flex:1 1 320px;max-width:720px}
.row>svg{flex:1 1 480px;max-width:760px}
figcaption{margin-bottom:4px}img{width:100%;display:block}table{border-collapse:collapse;margin:1em 0;font-size:13px}
td,th{padding:3px 10px;text-align:right;border-bottom:1px solid #3f3f46}td:first-child,th:first-child{text-align:left}
.warn{background:#451a03;padding:.5em 1em}.failed{background:#450a0a;padding:.5em 1em}code{font-size:12px;color:#a1a1aa}
"""


def as_json(found: Measured, against: str) -> dict:
    """Every number of a file."""
    return {
        "file": os.path.basename(found.file),
        "blender": found.blender,
        "stopped": found.stopped,
        "frames": found.frames,
        "references": {
            name: {"samples": r.samples, "seconds": r.seconds, "relmse_trimmed": r.error.tolist()}
            for name, r in found.references.items()
        },
        "disagreement": found.disagreement,
        "failures": found.failures,
        "points": {
            name: {
                str(seed): [[vars(point) for point in points] for points in frames] for seed, frames in by_seed.items()
            }
            for name, by_seed in found.points.items()
        },
        "error_bars": {name: [found.bars(name, index) for index in range(len(found.frames))] for name in found.points},
        "against": against,
        "comparisons": comparisons(found, against),
    }


def comparisons(found: Measured, against: str) -> list:
    """{"contestant", "frame", "time", ...} of every contestant, frame and way of counting time."""
    rows = []
    for contestant in found.contestants:
        if contestant.text == against:
            continue
        for index, frame in enumerate(found.frames):
            for time in _TIMES:
                result = found.against(contestant.text, against, time, index)
                past = found.beyond(contestant.text, against, time, index)
                facts = {"contestant": contestant.text, "frame": frame, "time": time, "result": result}
                rows.append(facts | {"extrapolated": vars(past) | {"ratio": past.ratio} if past else None})
    return rows


def table(found: Measured, against: str) -> list:
    """Rows of text: a contestant and frame a row, the first row a header."""
    rows = [["", "s at equal error", against, f"faster than {against}", "sampling alone", "in CPU s", "error"]]
    rows[0] += ["sync + build s", "extrapolated by 1/n"]
    by_key = {(r["contestant"], r["frame"], r["time"]): r["result"] for r in comparisons(found, against)}
    for contestant in found.contestants:
        for index, frame in enumerate(found.frames):
            name = contestant.text + ("" if frame is None else f", frame {frame}")
            sync = _sync(found, contestant.text, index)
            if contestant.text == against:
                best = found.median(against, WITH_SYNC, index)
                error = f"{min(e for _, e in best):.3g}" if best else "n/a"
                rows.append([name, "", "", "", "", "", f"{error} at last", sync, ""])
                continue
            whole, alone, cpu = (by_key[contestant.text, frame, time] for time in _TIMES)
            seconds = [f"{s:.3g}" for s in whole["seconds"]] if whole else ["n/a", "n/a"]
            error = f"{whole['error']:.3g}" if whole else "n/a"
            past = shown_beyond(found.beyond(contestant.text, against, WITH_SYNC, index))
            rows.append([name, *seconds, shown(whole), shown(alone), shown(cpu), error, sync, past])
    return rows


def _sync(found, name, index) -> str:
    values = [p.sync_build_seconds for frames in found.points.get(name, {}).values() if frames for p in frames[index]]
    return f"{np.median(values):.3g}" if values else "n/a"


def write_report(folder: str, run: dict, results: list, against: str) -> None:
    """Writes bench.json and index.html: of every Measured so far."""
    facts = {"run": run, "files": [as_json(found, against) for found in results]}
    write_text(os.path.join(folder, "bench.json"), json.dumps(facts, indent=1, default=str) + "\n")
    parts = [f"<!doctype html><html lang=en><meta charset=utf-8><title>Headwater bench</title><style>{_STYLE}</style>"]
    size = run["settings"]["size"]
    parts.append(f"<h1>Error against time: against {_e(against)}</h1>")
    bounces = run["settings"]["max_bounces"]
    parts.append(
        f"<p>{size[0]} x {size[1]} pixels, {'direct light only' if not bounces else f'{bounces} bounces'}, "
        f"{run['settings']['threads'] or run['machine']['cores']} threads, {run['settings']['seeds']} seeds, "
        f"{_e(run['machine']['cpu'])}, device {_e(run['device'])}, tracer {_e(run['tracer'])}, "
        f"Headwater {_e(run['headwater'])}. {_what(run['settings'])}"
        "Error: relMSE without the worst 0.1 % of pixels. Times of both engines are "
        "of one run, in turns; their ratios count, not the seconds.</p>"
    )
    parts.append(f"<p><code>{_e(run['command'])}</code></p>")
    parts += [_file(found, run, against) for found in results]
    write_text(os.path.join(folder, "index.html"), "\n".join(parts) + "\n")


def _what(settings: dict) -> str:
    """What is rendered, where it is no still as it comes out of the renderer."""
    said = ""
    if settings.get("lead"):
        first = settings["lead"][0]
        said += (
            f"Frame {settings['frame']} of an animation rendered from frame {first} on, of which only it is counted: "
        )
        said += "its seconds, those of bringing the scene from the frame before to it included. "
    if settings.get("denoise"):
        said += "Pictures are denoised before they are measured, all by the same denoiser, whose time is left out. "
    return said


def _e(text) -> str:
    return html.escape(str(text))


def _file(found: Measured, run: dict, against: str) -> str:
    out = [f"<h2>{_e(os.path.basename(found.file))}</h2>"]
    if found.stopped:
        out.append("<p class=warn>Stopped before it was whole.</p>")
    out += [f"<p class=failed>{_e(name)}: {_e(reason)}</p>" for name, reason in found.failures.items()]
    for frame, facts in zip(found.frames, found.disagreement, strict=False):
        where = "" if frame is None else f"frame {frame}: "
        kind = " class=warn" if "more than noise" in disagreement_line(facts) else ""
        out.append(f"<p{kind}>References, {where}{_e(disagreement_line(facts))}.</p>")
    own = [f"{_e(n)} {r.error.mean():.3g} ({r.samples} samples)" for n, r in found.references.items()]
    out.append(f"<p>Trimmed relMSE of the references' own noise: {'; '.join(own)}. Measured against: ")
    out.append(f"{_e(run['settings']['reference'])}.</p>")
    head, *rows = table(found, against)
    out.append("<table><tr>" + "".join(f"<th>{_e(cell)}" for cell in head))
    out += ["<tr>" + "".join(f"<td>{_e(cell)}" for cell in row) for row in rows]
    out.append(
        "</table><p>n/a, &gt; and &lt;: the curves do not overlap in error, or only in part. "
        "<i>Extrapolated</i>: at the last error of ours, below all that the other was rendered to; its line is carried "
        "on by error &prop; 1 / samples. No render says so. Bars: the least and the largest of the seeds.</p>"
    )
    for index, frame in enumerate(found.frames):
        out.append("<div class=row>")
        for time, title in _PLOTS:
            series = [
                (
                    c.text,
                    COLOURS[i % len(COLOURS)],
                    found.median(c.text, time, index),
                    found.curves(c.text, time, index),
                )
                for i, c in enumerate(found.contestants)
            ]
            where = title if frame is None else f"frame {frame}, {title}"
            out.append(log_log(where, "seconds", "trimmed relMSE", series))
        out.append("</div>")
    out.append(_pictures(found, run))
    return "\n".join(out)


def equal_time(found: Measured) -> dict:
    """contestant -> its point (of the first seed, last frame) that took closest to the time that all of them have."""
    ladders = {name: by_seed[1][-1] for name, by_seed in found.points.items() if by_seed.get(1) and by_seed[1][-1]}
    if not ladders:
        return {}
    common = min(points[-1].seconds for points in ladders.values())
    common = max(common, *(points[0].seconds for points in ladders.values()))
    return {
        name: min(points, key=lambda p: abs(np.log(p.seconds / common)) if p.seconds > 0 else np.inf)
        for name, points in ladders.items()
    }


def _pictures(found: Measured, run: dict) -> str:
    chosen = equal_time(found)
    if not chosen:
        return ""
    choice = run["settings"]["reference"]
    engines = {c.text: c.engine for c in found.contestants}
    target = chosen_reference(found, choice, "headwater").pixels[-1]
    exposure = exposure_of(target)
    out = ["<h3>At about equal time</h3><div class=row>"]
    for name, point in chosen.items():
        picture = found.pictures.get((name, point.samples))
        if picture is None:
            continue
        expected = chosen_reference(found, choice, engines[name]).pixels[-1]
        off = tone_map(np.abs(picture - expected) / (np.abs(expected) + 0.1) / 2, 1.0)
        said = f"{name}: {point.seconds:.3g} s, {point.samples} samples, error {point.errors['relmse_trimmed']:.3g}"
        out.append(
            f"<figure><figcaption>{_e(said)}</figcaption>{_image(tone_map(picture, exposure))}{_image(off)}</figure>"
        )
    out.append(f"<figure><figcaption>reference</figcaption>{_image(tone_map(target, exposure))}</figure></div>")
    return "".join(out)


def _image(pixels) -> str:
    with tempfile.TemporaryDirectory(prefix="headwater-bench-") as folder:
        path = os.path.join(folder, "picture.png")
        write_png8(path, pixels)
        with open(path, "rb") as file:
            data = base64.b64encode(file.read()).decode()
    return f'<img alt="" src="data:image/png;base64,{data}">'

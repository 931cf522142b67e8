# SPDX-License-Identifier: Apache-2.0
"""The report of `headwater figures`: index.html with relative links only, and figures.json with every number."""

import html
import json
import os

from headwater.figures import claims
from headwater.output import write_text

_COLUMNS = (
    ("relmse", "relMSE", "{:.4g}"),
    ("relmse_trimmed", "trimmed relMSE", "{:.4g}"),
    ("lit_relmse_trimmed", "of surfaces", "{:.4g}"),
    ("mape", "MAPE", "{:.3f}"),
    ("flip", "FLIP", "{:.4f}"),
    ("mean_signed_error_percent", "mean signed error", "{:+.2f} %"),
    ("lit_signed_percent", "of surfaces", "{:+.2f} %"),
    ("neighbour_correlation", "neighbours' correlation", "{:.3f}"),
    ("block_share", "shared in 4 x 4 blocks", "{:.3f}"),
    ("black_share", "black pixels", "{:.2%}"),
    ("seconds", "seconds", "{:.1f}"),
    ("reservoir_bytes", "reservoirs", None),
)
_MARKS = {True: ("yes", "agrees"), False: ("no", "does not agree"), None: ("open", "not told")}
_STYLE = """
body{background:#18181b;color:#e4e4e7;font:15px/1.5 system-ui,sans-serif;margin:2em auto;
max-width:1500px;padding:0 1.5em}
h1,h2{font-weight:600}h2{margin-top:2.6em;border-top:1px solid #3f3f46;padding-top:1em}a{color:#93c5fd}
.caption{color:#a1a1aa;font-style:italic;margin:.2em 0 1em}.row{display:flex;flex-wrap:wrap;gap:12px}
figure{margin:0;flex:1 1 300px;max-width:720px}
figcaption{font-weight:600;margin-bottom:4px}img{width:100%;display:block}
.insets{display:flex;gap:4px;margin-top:4px}.insets img{flex:1;min-width:0;image-rendering:pixelated}
table{border-collapse:collapse;margin:1em 0;font-size:13px}
td,th{padding:3px 10px;text-align:right;border-bottom:1px solid #3f3f46}
td:first-child,th:first-child{text-align:left}.claims td{text-align:left;vertical-align:top}
.yes{color:#4ade80}.no{color:#f87171}.open{color:#fbbf24}.failed{background:#450a0a;padding:.6em 1em}
code{font-size:12px;color:#a1a1aa;word-break:break-all}details{margin:.4em 0}
"""


def verdicts_of(figure, record) -> list:
    """JSON-ready verdicts of a figure's record."""
    numbers = {v["name"]: v["numbers"] for v in record["variants"] if v.get("numbers")}
    return [vars(verdict) for verdict in claims.verdicts(figure, numbers)]


def write_report(folder: str, records: list, run: dict) -> None:
    """Writes figures.json and index.html. records: one dictionary a figure, from make.py, in order."""
    write_text(os.path.join(folder, "figures.json"), json.dumps({"run": run, "figures": records}, indent=1) + "\n")
    parts = [f"<!doctype html><html lang=en><meta charset=utf-8><title>Figures</title><style>{_STYLE}</style>"]
    parts.append("<h1>The paper's figures, by Headwater</h1>")
    parts.append(
        "<p>Each picture beside its error against a converged reference of the same scene: unbiased path tracing with "
        "lights chosen by power, whose own error is stated. Error maps: relative, black 0 to pale 1; signed, blue too "
        "dark, red too bright. Every verdict follows from the numbers beside it. The scenes are this project's own.</p>"
    )
    parts.append(f"<p>{_e(_run_line(run))}</p>{_overview(records)}")
    parts += [_figure(record) for record in records]
    write_text(os.path.join(folder, "index.html"), "\n".join(parts) + "\n")


def _e(text) -> str:
    return html.escape(str(text))


def _run_line(run) -> str:
    said = f"Headwater {run['headwater']}, device {run.get('device') or 'n/a'}, tracer {run.get('tracer') or 'n/a'}."
    return said + " Seconds are of rendering, on a machine that may have been busy: compare them within a figure only."


def _overview(records) -> str:
    rows = []
    for record in records:
        for verdict in record["verdicts"]:
            kind, word = _MARKS[verdict["agrees"]]
            link = f'<a href="#f{record["id"]}">{record["id"]}</a>'
            rows.append(f"<tr><td>{link}<td>{_e(verdict['paper'])}<td class={kind}>{word}")
    return f"<table class=claims><tr><th>Figure<th>The paper says<th>Here{''.join(rows)}</table>"


def _figure(record) -> str:
    out = [f'<h2 id="f{record["id"]}">Figure {record["id"]}: {_e(record["title"])}</h2>']
    out.append(f"<p class=caption>The paper: “{_e(record['caption'])}”</p>")
    facts, size = record["scene"], record["size"]
    out.append(
        f"<p>Scene {_e(facts['scene'])}: {facts['lights']:,} light sources, {facts['triangles']:,} triangles. "
        f"{size[0]} x {size[1]} pixels, {record['samples']} samples a pixel, "
        f"{'direct light only' if not record['bounces'] else str(record['bounces']) + ' bounces'}. "
    )
    reference = record.get("reference")
    if reference:
        own = reference["error"]
        out.append(
            f"Reference: {reference['samples']:,} samples, {reference['seconds']:.0f} s; its own relMSE "
            f"{own['relmse']:.3g}, trimmed {own['relmse_trimmed']:.3g}, of surfaces "
            f"{cell(own['lit_relmse_trimmed'], '{:.3g}')}{_warn(record)}.</p>"
        )
    out += [f"<p class=failed>{_e(reason)}</p>" for reason in record["failures"]]
    out.append(_claims(record["verdicts"]))
    out.append("<div class=row>" + "".join(_picture(v) for v in _shown(record)) + "</div>")
    out.append(_table(record))
    if record.get("sheet"):
        out.append(f'<p><a href="{_e(record["sheet"])}">contact sheet</a></p>')
    commands = [v["command"] for v in record["variants"] if v.get("command")]
    out.append(
        "<details><summary>commands</summary>" + "".join(f"<p><code>{_e(c)}</code>" for c in commands) + "</details>"
    )
    return "\n".join(out)


def _warn(record) -> str:
    """A word where the reference is not far better than the best picture."""
    errors = [v["numbers"]["lit_relmse_trimmed"] or 0.0 for v in record["variants"] if v.get("numbers")]
    own = record["reference"]["error"]["lit_relmse_trimmed"] or 0.0
    if errors and min(errors) > 0 and own > 0.2 * min(errors):
        return f" ({100 * own / min(errors):.0f} % of the best picture's: differences that small are noise)"
    return ""


def _shown(record) -> list:
    shown = [v for v in record["variants"] if v.get("files")]
    return shown + (
        [record["reference"] | {"label": "reference"}] if (record.get("reference") or {}).get("files") else []
    )


def _picture(variant) -> str:
    files = variant["files"]
    insets = "".join(f'<img src="{_e(f)}" alt="inset">' for f in files["insets"])
    picture = f'<a href="{_e(files["picture"])}"><img src="{_e(files["framed"])}" alt="{_e(variant["label"])}"></a>'
    maps = "".join(f'<a href="{_e(f)}"><img src="{_e(f)}" alt="error map"></a>' for f in files.get("maps", ()))
    text = f"<figure><figcaption>{_e(variant['label'])}</figcaption>{picture}<div class=insets>{insets}</div>"
    return text + f"<div class=insets>{maps}</div></figure>"


def _claims(verdicts) -> str:
    rows = []
    for verdict in verdicts:
        kind, word = _MARKS[verdict["agrees"]]
        rows.append(f"<tr><td>{_e(verdict['paper'])}<td>{_e(verdict['ours'])}<td class={kind}>{word}")
    return f"<table class=claims><tr><th>The paper says<th>Measured here<th>{''.join(rows)}</table>"


def _table(record) -> str:
    head = "".join(f"<th>{title}" for _, title, _ in _COLUMNS)
    rows = []
    for variant in record["variants"]:
        if not variant.get("numbers"):
            rows.append(
                f"<tr><td>{_e(variant['label'])}<td colspan={len(_COLUMNS)}>{_e(variant.get('failure', 'not made'))}"
            )
            continue
        cells = "".join(f"<td>{cell(variant['numbers'].get(key), form)}" for key, _, form in _COLUMNS)
        rows.append(f"<tr><td>{_e(variant['label'])}{cells}")
    return f"<table><tr><th>{head}{''.join(rows)}</table>"


def cell(value, form) -> str:
    """A number as the tables show it; n/a where there is none."""
    if value is None:
        return "n/a"
    return f"{value / 2**20:.2f} MiB" if form is None else form.format(value)

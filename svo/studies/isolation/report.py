"""A study as one HTML page that opens offline: configuration, tables, pictures, and what the words mean."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from svo.plant import HEALTHY, Plant
from svo.store import write_text
from svo.studies.isolation import tables
from svo.studies.isolation.figures import Picture
from svo.studies.isolation.summary import ConditionSummary

_GLOSSARY = {
    "falsified": "No initial state, disturbance, noise and uncertainty within a model's stated bounds explains the "
    "data. Said only with a certificate that was checked in exact rational arithmetic; it is proved given the bounds "
    "and the set of states at the start of the observer's window.",
    "detected": "The nominal model is falsified. The delay counts the first faulty sample as one sampling time: "
    "t_alarm − t_fault + Ts.",
    "isolated": "Only the true fault's model is left alive. The delay is counted in the same way.",
    "mean, median, 5–95 %": "The mean is over the runs that got there (its Student's 95 % interval is in summary.csv); "
    "median and quantiles are over all runs of the kind, ∞ where they fall among runs that did not get there.",
    "runs": "How many runs got there, of how many.",
    "false alarm": "The nominal model was falsified before the fault began, or in a fault-free run.",
    "wrong isolation": "The true fault's model was falsified, or another one was left alone.",
    "alive": "Not falsified: the model still explains everything that was measured. Several models alive at the end "
    "are no error; the data then do not tell them apart.",
    "undecided": "An answer that is neither a proof of falsification nor a point that explains the data (solver "
    "trouble). It is never an alarm.",
}


def write_report(
    path: Path,
    plant: Plant,
    identity: Mapping[str, Any],
    summaries: Sequence[ConditionSummary],
    pictures: Iterable[Picture],
    interactive: str = "",
    failed: Sequence[str] = (),
) -> None:
    """Write the report of a study.

    Parameters
    ----------
    path : path of the HTML file
    plant : Plant
        For its title, units and reference figures.
    identity : mapping
        "configuration" and "versions" of the study, as stored with it.
    summaries : sequence of ConditionSummary
    pictures : iterable of Picture
        Embedded into the page.
    interactive : str
        HTML of the views that a reader can move in (`svo.studies.isolation.interactive`).
    failed : sequence of str
        A line for each run that failed (`svo.studies.runs.failures`).
    """
    configuration = identity["configuration"]
    parts = [
        f"<h1>Isolation-time study: {escape(plant.title)}</h1>",
        f'<p class="soft">{escape(_subtitle(summaries, configuration))}</p>',
        "<h2>What came out</h2>",
        _findings(summaries, failed),
        *(html_table(tables.delay_table(plant, group)) for group in _by_noise(summaries)),
        f'<p class="soft">Paper: {escape(plant.reference_title)}; a dash where it says nothing.</p>'
        if plant.reference
        else "",
        interactive,
        "<h2>Pictures</h2>",
        *(html_figure(picture) for picture in pictures),
        "<h2>What is counted</h2>",
        "<dl>" + "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _GLOSSARY.items()) + "</dl>",
        "<h2>How to make it again</h2>",
        f"<p><code>{escape(_command(plant, configuration))}</code></p>",
        "<p>The table of runs is in <code>runs.parquet</code>, the statistics in <code>summary.csv</code>, every alarm "
        "with its certificate in <code>alarms.jsonl</code> (<code>svo verify</code> checks them). "
        "<code>svo simulate</code> with a run's seed makes that run's log.</p>",
        html_facts("Configuration", configuration),
        html_facts("Versions", identity["versions"]),
    ]
    script = _own("report.js") if interactive else ""
    write_page(path, f"Isolation-time study: {plant.title}", parts, script)


def write_page(path: Path, title: str, parts: Iterable[str], script: str = "") -> None:
    """Write pieces of HTML as one page with the reports' style, and perhaps a script, inside.

    Its policy lets a browser run that script and no other, and load nothing from elsewhere.
    """
    style = _own("report.css")
    allowed = "; ".join(f"{what}-src {_hash(text)}" for what, text in (("style", style), ("script", script)) if text)
    policy = f"default-src 'none'; img-src data:; {allowed}; base-uri 'none'; form-action 'none'"
    body = "\n".join([*parts, f"<script>{script}</script>" if script else ""])
    write_text(path, _PAGE.format(title=escape(title), policy=policy, style=style, body=body))


def _own(name: str) -> str:
    return files("svo.studies.isolation").joinpath(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """As a content security policy names the text of an element."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def _subtitle(summaries: Sequence[ConditionSummary], configuration: Mapping[str, Any]) -> str:
    runs = sum(s.runs for s in summaries)
    return f"{runs} runs, seed {configuration['seed']}, noise: {', '.join(configuration['noise'])}"


def _findings(summaries: Sequence[ConditionSummary], failed: Sequence[str]) -> str:
    lines = [*failed, *tables.counts(summaries), *tables.not_isolated(summaries), tables.cost(summaries)]
    return (
        '<ul class="findings">' + "".join(f"<li>{escape(line[0].upper() + line[1:])}.</li>" for line in lines) + "</ul>"
    )


def _by_noise(summaries: Sequence[ConditionSummary]) -> list[list[ConditionSummary]]:
    names = dict.fromkeys(s.noise for s in summaries)
    return [[s for s in summaries if s.noise == noise] for noise in names]


def html_table(table: tables.TextTable) -> str:
    """A table with its caption."""
    head = "".join(
        f'<th scope="col"{_label(i, table)}>{escape(name).replace(chr(10), "<br>")}</th>'
        for i, name in enumerate(table.header)
    )
    body = "".join(
        "<tr>"
        + "".join(
            f'<th scope="row" class="label">{escape(cell)}</th>' if i < table.labels else f"<td>{escape(cell)}</td>"
            for i, cell in enumerate(row)
        )
        + "</tr>\n"
        for row in table.rows
    )
    return (
        f'<div class="scroll"><table><caption><span>{escape(table.title)}</span></caption>\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>"
    )


def _label(i: int, table: tables.TextTable) -> str:
    return ' class="label"' if i < table.labels else ""


def html_figure(picture: Picture) -> str:
    """A picture inside the page, with its caption."""
    data = base64.b64encode(picture.path.read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.title)}">'
        f"<figcaption><b>{escape(picture.title)}.</b> {escape(picture.caption)}</figcaption></figure>"
    )


def html_facts(title: str, facts: Mapping[str, Any]) -> str:
    """Names and values, such as a configuration."""
    rows = "".join(
        f"<tr><th scope='row'>{escape(str(key))}</th><td>{escape(_text(value))}</td></tr>"
        for key, value in facts.items()
    )
    table = f'<table class="facts"><caption>{escape(title)}</caption><tbody>{rows}</tbody></table>'
    return f'<div class="scroll">{table}</div>'


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _command(plant: Plant, configuration: Mapping[str, Any]) -> str:
    options = [f"--runs {configuration['runs']}", f"--seed {configuration['seed']}"]
    options += [f"--noise {name}" for name in configuration["noise"]]
    options += [f"--architecture {name}" for name in configuration.get("architectures", ())]
    if list(configuration["faults"]) != [HEALTHY, *plant.faults]:
        options += [f"--fault {name}" for name in configuration["faults"]]
    return f"svo study {configuration['plant']} {' '.join(options)} --out DIR"

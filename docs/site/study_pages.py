"""The pages of studies: questions, verdicts and figures of shipped results."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path

from assemble import RESULTS, ROOT
from codesign_bench.claims.finding import VERDICTS
from codesign_bench.registry import built_in, load_module
from codesign_bench.study import Study, load_study
from fragments import plain, table, toctree


def shipped(study: Study) -> list[Path]:
    """Return the results folders whose verdicts are on the claims of a study."""
    found = sorted(RESULTS.glob("*/claims/claims.json"))
    return [path.parents[1] for path in found if json.loads(path.read_text(encoding="utf-8"))["study"] == study.name]


def studies() -> str:
    """Return the page that lists the studies with the numbers of their verdicts."""
    rows = []
    for name in built_in("studies"):
        study = load_study(name)
        rows.append((f"[{name}](/studies/{name}.md)", study.title, study.source, verdicts(study)))
    lead = (
        "A [study](docs/experiments.md) asks one question and describes as data what the answer needs: experiments, "
        "figures and claims. Each claim is judged by a [rule](docs/claims.md) that was written down before the results."
    )
    listing = table(("study", "title", "source", "verdicts"), rows)
    return f"# Studies\n\n{lead}\n\n{listing}\n" + toctree(built_in("studies"))


PARTS = {"claims": "claims", "checks_of_scenes": "checks of scenes"}
"""Part of `claims.json` -> what its entries are called."""


def verdicts(study: Study) -> str:
    """Return how many claims of a study got which verdict, checks of scenes apart; or that nothing is shipped."""
    outcomes = []
    for folder in shipped(study):
        judged = json.loads((folder / "claims" / "claims.json").read_text(encoding="utf-8"))
        for part, label in PARTS.items():
            counts = [f"{number} {v}" for v in VERDICTS if (number := sum(c["verdict"] == v for c in judged[part]))]
            outcomes += [f"{folder.name}: {len(judged[part])} {label}: {', '.join(counts)}"] if judged[part] else []
    return "; ".join(outcomes) or "no results yet"


def study_page(study: Study) -> str:
    """Return a study's page: question, experiments, and for shipped results verdicts, figures and every claim."""
    experiments = [
        (f"`{name}`", ", ".join(f"`{figure}`" for figure in one.figures), one.source)
        for name, one in study.experiments.items()
    ]
    parts = [
        f"# {study.title}",
        study.question,
        f"Source: {study.source}. Methods: {', '.join(f'[{m}](docs/methods/{m}.md)' for m in study.methods)}.",
        f"```\ncodesign-bench reproduce --study {study.name}\n```",
        f"## Experiments\n\n{table(('experiment', 'figures', 'source'), experiments)}",
    ]
    folders = shipped(study)
    if not folders:
        parts.append("## Verdicts\n\nNo results of this study are shipped yet, so no claim is judged.")
    for folder in folders:
        name = folder.relative_to(ROOT).as_posix()
        parts += [
            f"## Verdicts on {name}\n\n[{name}]({name}/README.md) says how these results were made, and which verdicts "
            "do not count any more. Read it before you use a number from here.",
            claims_of(folder),
            f"## Figures of {name}\n\n{figures_of(study, folder)}",
        ]
    return "\n\n".join(parts) + "\n"


def claims_of(folder: Path) -> str:
    """Return what `verify` wrote about the claims, one level down, without its title."""
    text = (folder / "claims" / "claims.md").read_text(encoding="utf-8").split("\n", 1)[1].strip()
    return re.sub(r"^## ", "### ", text, flags=re.MULTILINE)


def figures_of(study: Study, folder: Path) -> str:
    """Return the study's shipped figures, each with its caption and a link to its numbers."""
    parts = []
    for name in study.figures:
        path = folder / "figures" / f"{name}.png"
        if not path.exists():
            continue
        module = load_module("paper_figs", name)
        doc = " ".join((inspect.getdoc(module) or "").split("\n\n")[0].split())
        place = path.relative_to(ROOT).as_posix()
        numbers = f" [Numbers]({place.removesuffix('.png')}.csv)." if path.with_suffix(".csv").exists() else ""
        parts.append(f"### {module.TITLE}\n\n[![{module.TITLE}: {plain(doc)}]({place})]({place})\n\n{doc}{numbers}")
    return "\n\n".join(parts)

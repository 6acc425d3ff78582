"""Fill the tables of the pages that show shipped results: `python results/fill_tables.py [--check]`.

A table stands between `<!-- NAME -->` and `<!-- end -->`. With `--check` nothing is written; the exit code is 1 when a
page is not what the results say.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import codesign_bench as cb
from codesign_bench.claims.evidence import load_evidence
from codesign_bench.claims.verify import Row, by_rule, contradicted, judge
from codesign_bench.registry import load_module
from codesign_bench.study import DEFAULT_STUDY, load_study

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "results" / "reference"
LONGER = ROOT / "results" / "longer"
PAGES = {ROOT / "README.md": REFERENCE, REFERENCE / "README.md": REFERENCE, LONGER / "README.md": LONGER}
"""Every page and the results that its tables show."""
TABLE = re.compile(r"(<!-- (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def _final_results(results: Path) -> str:
    return load_module("paper_figs", "final_results").texts(cb.load_results(results))["md"]


def _success(results: Path) -> str:
    final = load_module("paper_figs", "final_results")
    return final.success_by_task(final.data(cb.load_results(results)))


@lru_cache
def _judged(results: Path) -> list[Row]:
    claims = load_study(DEFAULT_STUDY).claims()
    return judge(claims, load_evidence(results), results.relative_to(ROOT).as_posix())


MAKERS: dict[str, Callable[[Path], str]] = {
    "final_results": _final_results,
    "success": _success,
    "claims": lambda results: by_rule(_judged(results)),
    "contradicted": lambda results: contradicted(_judged(results)),
}
"""Every table by its name, made from a results folder."""


def filled(page: str, results: Path) -> str:
    """Return a page with every table made anew from `results`."""
    return TABLE.sub(lambda found: f"{found[1]}\n{MAKERS[found['name']](results)}\n{found[3]}", page)


def main() -> int:
    """Fill or check the pages and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    stale = []
    for path, results in PAGES.items():
        page = path.read_text(encoding="utf-8")
        made = filled(page, results)
        if made != page:
            stale.append(path)
            if not check:
                path.write_text(made, encoding="utf-8")
    print("\n".join(f"{'stale' if check else 'filled'}: {path.relative_to(ROOT)}" for path in stale) or "up to date")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())

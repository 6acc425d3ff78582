"""Fill the tables of the two pages that show the reference results: `python results/fill_tables.py [--check]`.

A table stands between `<!-- NAME -->` and `<!-- end -->`. With `--check` nothing is written; the exit code is 1 when a
page is not what the results say.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping
from pathlib import Path

import codesign_bench as cb
from codesign_bench.claims.evidence import Measure, load_evidence
from codesign_bench.claims.paper import CLAIMS, OUTSIDE
from codesign_bench.claims.verify import by_rule, contradicted, judge
from codesign_bench.registry import load_module

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "results" / "reference"
PAGES = (ROOT / "README.md", REFERENCE / "README.md")
TABLE = re.compile(r"(<!-- (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def tables() -> dict[str, str]:
    """Return every table by its name, made from the reference results."""
    frame = cb.load_results(REFERENCE)
    final = load_module("paper_figs", "final_results")
    rows = judge(CLAIMS, load_evidence(REFERENCE, Measure(False, OUTSIDE, print)), "results/reference")
    return {
        "final_results": final.texts(frame)["md"],
        "success": final.success_by_task(final.data(frame)),
        "claims": by_rule(rows),
        "contradicted": contradicted(rows),
    }


def filled(page: str, made: Mapping[str, str]) -> str:
    """Return a page with every table replaced by the one of its name in `made`."""
    return TABLE.sub(lambda found: f"{found[1]}\n{made[found['name']]}\n{found[3]}", page)


def main() -> int:
    """Fill or check the pages and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    made, stale = tables(), []
    for path in PAGES:
        page = path.read_text(encoding="utf-8")
        if filled(page, made) != page:
            stale.append(path)
            if not check:
                path.write_text(filled(page, made), encoding="utf-8")
    print("\n".join(f"{'stale' if check else 'filled'}: {path.relative_to(ROOT)}" for path in stale) or "up to date")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())

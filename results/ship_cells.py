"""Copy finished cells into results that are shipped: `python results/ship_cells.py RUNS [SHIPPED]`.

What only resuming needs stays behind. Of policies, every seed of the paper's method on the default variant and the
lowest seed of everything else go along; `--policies all` takes every one, `--policies none` none. `--task` takes the
cells of some tasks alone, e.g. those whose seeds are complete. A cell that is there already is left as it is.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Collection, Iterable
from pathlib import Path

from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import reported_cells
from codesign_bench.storage.layout import CURVE_FILE, EVALUATION_FILE, METRICS_FILE, POLICY_FILE, open_folder
from codesign_bench.storage.records import CELL_FILE, CellRecord
from codesign_bench.studies.corl2023.members import OURS

REFERENCE = Path(__file__).resolve().parent / "reference"
"""Where cells go unless told otherwise."""
RECORDS = (CURVE_FILE, METRICS_FILE, EVALUATION_FILE, CELL_FILE)
"""What is shipped of every cell; the file that says it is finished comes last."""
POLICIES = ALL, SOME, NONE = "all", "some", "none"
"""Which policies are taken: of every cell, those that `ships_policy` names, or none."""


def ships_policy(cell: CellRecord, cells: Iterable[CellRecord]) -> bool:
    """Return whether the policy of a cell is shipped, one of `cells`."""
    if cell.method == OURS and cell.variant == DEFAULT:
        return True
    alike = [other.seed for other in cells if _kind(other) == _kind(cell)]
    return cell.seed == min(alike)


def _kind(cell: CellRecord) -> tuple[str, str, Variant]:
    return cell.task, cell.method, cell.variant


def ship(runs: Path, shipped: Path, policies: str = SOME, tasks: Collection[str] | None = None) -> list[Path]:
    """Copy the finished cells of `runs` that `shipped` lacks and return their folders there.

    Args:
        runs: results folder.
        shipped: results folder; made if there is none.
        policies: which policies are taken, one of `POLICIES`.
        tasks: names of the tasks whose cells are taken; None: all.

    Raises:
        UserError: `runs` is no results folder, or `shipped` cannot be one.
    """
    copied = []
    cells = [cell for cell in reported_cells(runs) if cell.is_done and (tasks is None or cell.record.task in tasks)]
    records = [cell.record for cell in cells]
    open_folder(shipped)
    for cell in cells:
        target = shipped / cell.folder.relative_to(runs)
        if (target / CELL_FILE).exists():
            continue
        target.mkdir(parents=True, exist_ok=True)
        takes_policy = policies == ALL or (policies == SOME and ships_policy(cell.record, records))
        policy = (POLICY_FILE,) if takes_policy else ()
        for name in (*policy, *RECORDS):
            shutil.copyfile(cell.folder / name, target / name)
        copied.append(target)
    return copied


def main() -> int:
    """Copy what the command line names and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, metavar="RUNS")
    parser.add_argument("shipped", type=Path, metavar="SHIPPED", nargs="?", default=REFERENCE)
    parser.add_argument("--policies", choices=POLICIES, default=SOME)
    parser.add_argument("--task", nargs="+", metavar="T")
    arguments = parser.parse_args()
    try:
        copied = ship(arguments.runs, arguments.shipped, arguments.policies, arguments.task)
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join(str(folder) for folder in copied) or "nothing new")
    return 0


if __name__ == "__main__":
    sys.exit(main())

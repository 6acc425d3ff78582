"""Draw figures from results and save each as picture, vector graphic and table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from codesign_bench.errors import UserError
from codesign_bench.files import write_bytes
from codesign_bench.registry import load_module, names
from codesign_bench.results import load_results


def draw_figures(wanted: Sequence[str], results: Path, out: Path, say: Callable[[str], None]) -> None:
    """Draw `wanted`, or every figure that the results allow, and tell the paths; pictures come last.

    Raises:
        UserError: an unknown figure, a folder that cannot be written, or nothing that can be drawn.
    """
    modules = {name: load_module("paper_figs", name) for name in wanted or names("paper_figs")}
    frame = load_results(results)
    _make_folder(out)
    drawn: list[Path] = []
    for name, module in modules.items():
        try:
            drawn += save_figure(name, module, frame, out)
        except UserError as error:
            if wanted:
                raise
            say(f"{name} left out: {error}")
    if not drawn:
        raise UserError(f"the results in '{results}' allow no figure yet")
    for path in sorted(drawn, key=lambda path: path.suffix == ".png"):
        say(str(path))


def save_figure(name: str, module: object, frame: pd.DataFrame, out: Path) -> list[Path]:
    """Write the figure's table, vector graphic and picture into `out` and return their paths.

    Raises:
        UserError: the results lack something that the figure needs.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    table = module.data(frame)  # type: ignore[attr-defined]  # figures are modules with two functions
    figure = module.draw(frame)  # type: ignore[attr-defined]
    paths = [out / f"{name}.csv", out / f"{name}.pdf", out / f"{name}.png"]
    write_bytes(paths[0], table.to_csv(index=False, lineterminator="\n").encode())
    for path in paths[1:]:
        figure.savefig(path)
    plt.close(figure)
    return paths


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_bytes(out / ".writable", b"")
        (out / ".writable").unlink()
    except OSError as error:
        raise UserError(f"--out {out}: cannot write there ({error.strerror})") from error

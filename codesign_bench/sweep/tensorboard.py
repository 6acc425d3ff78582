"""Write curves and metrics of cells as TensorBoard scalars, while they run: `run --tensorboard`.

The sweep's own process follows the tables that cells write, so cells neither need TensorBoard nor wait for it.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from codesign_bench.cell.cell import Cell
from codesign_bench.errors import UnavailableError
from codesign_bench.storage.layout import CURVE_FILE, METRICS_FILE

FOLDER = "tensorboard"
"""Below the folder of a cell."""
EVENTS = "events.out.tfevents.*"
STEP = "env_steps"
POLL_SECONDS = 2.0
TABLES = {"curve": CURVE_FILE, "metrics": METRICS_FILE}
"""Group of scalars -> table with a row for each evaluation."""
INSTALL = "pip install 'codesign-bench[tensorboard]'"


def check_tensorboard() -> None:
    """Check that scalars can be written.

    Raises:
        UnavailableError: the package is missing.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter  # noqa: F401
    except ImportError as error:
        raise UnavailableError(f"--tensorboard needs tensorboard, which is not installed: {INSTALL}") from error


class Follower:
    """A thread that writes what cells add to their tables; a context manager around the sweep."""

    def __init__(self, cells: Sequence[Cell], out: Path) -> None:
        self._folders = [cell.folder(out) for cell in cells]
        self._writers: dict[Path, Any] = {}
        self._written: dict[Path, int] = {}
        """Table -> number of its rows that were written."""
        self._seen: dict[Path, int] = {}
        """Table -> time of its last change."""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._poll, daemon=True)

    def __enter__(self) -> Follower:
        check_tensorboard()
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._stop.set()
        self._thread.join()
        self.look()
        for writer in self._writers.values():
            with suppress(OSError):
                writer.close()

    def look(self) -> None:
        """Write the rows that tables have now and had not before."""
        for folder in self._folders:
            for group, name in TABLES.items():
                with suppress(OSError, ValueError, LookupError):  # nothing depends on it; the next look tries again
                    self._take(folder, group, folder / name)

    def _poll(self) -> None:
        while not self._stop.wait(POLL_SECONDS):
            self.look()

    def _take(self, folder: Path, group: str, path: Path) -> None:
        if not path.exists() or self._seen.get(path) == (changed := path.stat().st_mtime_ns):
            return
        import pandas as pd  # after the start: a cell that runs in this process takes less memory without it

        rows = pd.read_csv(path)
        writer = self._writer(folder)
        for row in rows.iloc[self._written.get(path, 0) :].to_dict("records"):
            for name, value in row.items():
                if name != STEP and isinstance(value, int | float):
                    writer.add_scalar(f"{group}/{name}", value, int(row[STEP]))
        writer.flush()
        self._written[path], self._seen[path] = len(rows), changed

    def _writer(self, folder: Path) -> Any:
        """Return the writer of a cell; what an earlier sweep wrote of the cell is replaced in the display."""
        from torch.utils.tensorboard import SummaryWriter

        if folder not in self._writers:
            place = folder / FOLDER
            earlier = any(place.glob(EVENTS))
            self._writers[folder] = SummaryWriter(str(place), purge_step=0 if earlier else None)
        return self._writers[folder]

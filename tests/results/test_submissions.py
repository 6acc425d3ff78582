"""Every archive in `results/submissions` is whole, and ours has the shipped results."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.sharing.leaderboard import OWN
from codesign_bench.storage.archive import check_archive
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.places import unpacked
from codesign_bench.storage.survey import survey

RESULTS = Path(__file__).resolve().parents[2] / "results"
ARCHIVES = sorted((RESULTS / "submissions").glob("*.zip"))

if not RESULTS.is_dir():
    pytest.skip("a source distribution leaves the results out", allow_module_level=True)

pytestmark = pytest.mark.reference


@pytest.mark.parametrize("archive", ARCHIVES, ids=lambda path: path.stem)
def test_an_archive_is_whole_and_every_file_can_be_used(archive: Path) -> None:
    assert check_archive(archive).cells == len(list(find_cells(unpacked(archive))))
    assert survey(unpacked(archive)) == []


def test_ours_has_the_shipped_results() -> None:
    packed = {name: file.sha256 for name, file in check_archive(RESULTS / "submissions" / f"{OWN}.zip").files.items()}
    names = {name for name in packed if name.endswith("/cell.json")}
    cells = [cell for cell in find_cells(RESULTS / "reference") if cell.record.variant == DEFAULT]
    advice = "make it anew: results/submissions/README.md"
    assert names == {f"{cell.folder.relative_to(RESULTS / 'reference').as_posix()}/cell.json" for cell in cells}, advice
    for cell in cells:
        name = cell.folder.relative_to(RESULTS / "reference").as_posix()
        for file, found in cell.record.checksums.items():
            assert packed[f"{name}/{file}"] == found, advice


def test_archives_stay_small() -> None:
    assert sum(archive.stat().st_size for archive in ARCHIVES) < 20e6

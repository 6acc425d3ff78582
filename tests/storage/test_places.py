"""Results are found as a folder, as an archive, or by the name of the shipped ones; a line says what is not there."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

import codesign_bench as cb
from builders import VERSION_0_1_0, rising, store_cell
from codesign_bench.errors import UserError
from codesign_bench.storage import places
from codesign_bench.storage.archive import files_in, write_archive
from codesign_bench.storage.cells import open_cell, scan
from codesign_bench.storage.layout import open_folder
from codesign_bench.storage.manifest import Manifest
from codesign_bench.storage.places import INSTALL, cell_folder, reference_folder, results_folder, shown

CELL = "push/gnn_ppo/default/seed-00"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder, where there is no checkout."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(places, "_checked_out", lambda: None)
    return tmp_path / "here"


@pytest.fixture
def archive(elsewhere: Path, tmp_path: Path) -> str:
    """Return the name of an archive with the curve of one cell."""
    runs = tmp_path / "runs"
    store_cell(runs, curve=rising(0.0, 2.0))
    write_archive(elsewhere / "mine.zip", runs, files_in(runs, [CELL]), Manifest())
    return "mine.zip"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a package of shipped results, whose code must not run."""
    package = tmp_path / "site" / places.PACKAGE
    shutil.copytree(VERSION_0_1_0, package / "reference")
    open_folder(package / "reference")
    (package / "__init__.py").write_text("raise RuntimeError('imported')\n")
    monkeypatch.syspath_prepend(tmp_path / "site")
    return package / "reference"


def test_a_folder_is_itself_whatever_its_name(elsewhere: Path) -> None:
    for name in ("runs", "reference", "runs.zip"):
        (elsewhere / name).mkdir()
        assert results_folder(name) == Path(name)
        assert shown(Path(name)) == name


def test_a_folder_that_is_not_there_is_left_to_the_caller_or_refused(elsewhere: Path) -> None:
    assert results_folder("nowhere") == Path("nowhere")
    with pytest.raises(UserError, match="no results folder 'nowhere'; give a folder of results, an archive"):
        results_folder("nowhere", must_exist=True)


def test_an_archive_is_unpacked_once_and_read_like_a_folder(archive: str) -> None:
    folder = results_folder(archive)
    assert folder == results_folder(archive)
    assert shown(folder) == "mine"
    assert [cell.record.seed for cell in scan(folder).cells] == [0]
    assert cb.load_results(archive)["return_mean"].tolist() == [0.0, 2.0]
    assert open_cell(f"{archive}/{CELL}").record.method == "gnn_ppo"


def test_an_archive_that_was_replaced_is_read_again(archive: str, elsewhere: Path, tmp_path: Path) -> None:
    before = results_folder(archive)
    store_cell(tmp_path / "runs", seed=1)
    (elsewhere / archive).unlink()
    names = files_in(tmp_path / "runs", [CELL, CELL.replace("-00", "-01")])
    write_archive(elsewhere / archive, tmp_path / "runs", names, Manifest())
    assert results_folder(archive) != before
    assert len(scan(results_folder(archive)).cells) == 2


def test_a_missing_archive_is_one_line() -> None:
    for given in ("no.zip", f"no.zip/{CELL}"):
        with pytest.raises(UserError, match=r"no archive 'no.zip'; write one with: codesign-bench pack"):
            results_folder(given) if given == "no.zip" else cell_folder(given)


def test_the_shipped_results_are_found_by_name_and_nothing_of_them_is_imported(installed: Path) -> None:
    assert results_folder("reference") == reference_folder() == installed
    assert not cb.load_results("reference").empty
    assert cell_folder(f"reference/{CELL}") == installed / CELL
    cb.load_policy(f"reference/{CELL}")
    assert places.PACKAGE not in sys.modules


def test_a_cell_that_is_not_there_is_answered_with_those_that_are(installed: Path, archive: str) -> None:
    del installed
    with pytest.raises(UserError, match="reference/push/gnn_ppo/default has: seed-00"):
        cb.load_policy("reference/push/gnn_ppo/default/seed-777")
    with pytest.raises(UserError, match=r"mine\.zip/push has: gnn_ppo"):
        open_cell(f"{archive}/push/cma_es/default/seed-00")
    with pytest.raises(UserError, match="is not a cell"):
        open_cell(f"{archive}/../{CELL}")


def test_without_the_package_a_line_says_how_to_install_it() -> None:
    for read in (results_folder, cb.load_results, lambda name: cb.load_policy(f"{name}/{CELL}")):
        with pytest.raises(UserError) as refused:
            read("reference")
        assert INSTALL in str(refused.value)


def test_the_path_of_a_checkout_is_answered_with_the_name(installed: Path) -> None:
    with pytest.raises(UserError, match=r"found by name: reference$"):
        results_folder("results/reference")
    with pytest.raises(UserError, match=r"found by name: reference$"):
        cell_folder(f"results/reference/{CELL}")
    shutil.rmtree(installed)
    with pytest.raises(UserError, match=INSTALL):
        results_folder("results/reference")


def test_a_checkout_has_the_shipped_results_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    if not (Path(__file__).resolve().parents[2] / "results" / "reference").is_dir():
        pytest.skip("a source distribution leaves the results out")
    assert reference_folder().parts[-2:] == ("results", "reference")

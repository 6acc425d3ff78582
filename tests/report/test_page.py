"""The report: one page that needs nothing else, tells what the results hold, and takes nothing in them for markup."""

from __future__ import annotations

from pathlib import Path

from codesign_bench.report.page import code_spans
from codesign_bench.storage.locks import locked
from codesign_bench.storage.records import FAILED, RUNNING, Failure, Timings
from reports import ATTACK, Reader, make_cell, report


def test_the_page_needs_no_other_file_and_no_network(page: str) -> None:
    addresses = Reader(page).addresses
    assert [address[:40] for address in addresses if not address.startswith(("data:", "#"))] == []
    assert "@import" not in page
    assert "url(" not in page


def test_what_results_hold_is_text_and_never_markup(page: str) -> None:
    reader = Reader(page)
    assert page.count(ATTACK) == 0
    assert f"it broke: {ATTACK}" in reader.text
    assert f"File {ATTACK}" in reader.text
    assert "script" not in reader.elements
    assert [name for name in reader.names if name.startswith("on")] == []
    assert "default-src 'none'" in page


def test_the_page_is_whole(page: str) -> None:
    reader = Reader(page)
    assert page.startswith("<!doctype html>")
    links = {address[1:] for address in reader.addresses if address.startswith("#")}
    assert links
    assert links <= set(reader.identities)
    assert len(reader.identities) == len(set(reader.identities))


def test_a_folder_in_which_nothing_is_finished_still_gives_a_page(tmp_path: Path) -> None:
    make_cell(tmp_path / "runs", 0, status=FAILED, failure=Failure("no luck", "line 1\nline 2"))
    with locked(make_cell(tmp_path / "runs", 1, status=RUNNING, timings=Timings())):
        text = Reader(report(tmp_path / "runs")).text
    assert "1 failed, 1 running" in text
    assert "No cell has finished yet" in text
    assert "No claim was judged: no finished cell" in text
    assert "No figure can be drawn from these results yet" in text
    assert "line 1\nline 2" in text


def test_the_page_tells_how_cells_were_made_otherwise(tmp_path: Path) -> None:
    for seed, commit in enumerate(("a" * 40, "b" * 40)):
        make_cell(tmp_path / "runs", seed, code={"commit": commit, "fingerprint": commit})
    text = Reader(report(tmp_path / "runs")).text
    assert "commits: aaaaaaaaaaaa (1 cell), bbbbbbbbbbbb (1 cell)" in text


def test_backticks_become_code_and_the_rest_stays_text() -> None:
    assert code_spans("the figure `a<b` & more") == "the figure <code>a&lt;b</code> &amp; more"
    assert code_spans("one ` alone <b>") == "one ` alone &lt;b&gt;"

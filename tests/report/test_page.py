"""The report: one page that needs nothing else, tells what the results hold, and takes nothing in them for markup."""

from __future__ import annotations

import base64
import json
import math
import shutil
import subprocess
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import codesign_bench
from builders import rising, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.finding import Finding
from codesign_bench.claims.verify import Row
from codesign_bench.cli import main
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.report.cells import read_cells
from codesign_bench.report.claims import part
from codesign_bench.report.final_values import STRIP_MARGIN, STRIP_WIDTH, estimate, strip, task_results, verdict
from codesign_bench.report.page import code_spans, write_report
from codesign_bench.report.provenance import code_version, configurations, version_table
from codesign_bench.seeding import generator
from codesign_bench.storage.frames import load_results
from codesign_bench.storage.layout import cell_lock
from codesign_bench.storage.records import CELL_FILE, FAILED, RUNNING, Failure, Timings

ATTACK = "<script>alert('x')</script><img src=http://example.com/x onerror=alert(1)>"
TASK = "reach"
VOID = {"meta", "img", "link", "br", "hr", "input"}


def config(epochs: int = 4, source: str = "default", **method: Sourced) -> StoredConfig:
    """Return a configuration of 1,000 steps."""
    return StoredConfig({"steps": Sourced(1000, "default")}, {"epochs": Sourced(epochs, source), **method})


def make_cell(out: Path, seed: int, *, returns: Sequence[float] = (), **changes: Any) -> Path:
    """Write a cell that was evaluated to `returns` every 100 steps, and to a success rate of a tenth of that."""
    facts = {
        "task": TASK,
        "label": "Ours",
        "env_steps": 100 * (len(returns) - 1) if returns else 0,
        "config": config(),
        "versions": {"python": "3.11.7", "torch": "2.13.0"},
        "host": {"name": "desk", "system": "Linux", "cpu": "some CPU", "cores": 2, "threads": 1},
        "timings": Timings(started="2026-01-02T03:04:05+00:00", train_s=50.0, evaluate_s=2.0, wall_s=60.0),
    }
    curve = [{**row, "success_rate": row["return_mean"] / 10} for row in rising(*returns)]
    return store_cell(out, seed=seed, curve=curve, **{**facts, **changes})


class Reader(HTMLParser):
    """Reads a page as a browser would: its elements, addresses and text; fails where elements do not close."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[str] = []
        self.addresses: list[str] = []
        self.names: set[str] = set()
        self.identities: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the element."""
        self.elements.append(tag)
        self.open += [] if tag in VOID else [tag]
        self.names |= {name for name, _ in attrs}
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "action")]
        self.identities += [value or "" for name, value in attrs if name == "id"]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element that closes itself."""
        self.elements.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close the element, which must be the last that was opened."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collect text."""
        self.text += data


def report(results: Path) -> str:
    """Return the page on `results`."""
    out = results.parent / "page" / "report.html"
    write_report(results, out, [].append)
    return out.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the page on three finished cells, one that failed, one that was interrupted, and a damaged one."""
    out = tmp_path_factory.mktemp("report") / "runs"
    for seed, final in enumerate((1.0, 2.0, 6.0)):
        make_cell(out, seed, returns=(0.0, final), label=ATTACK)
    make_cell(out, 3, status=FAILED, failure=Failure(f"it broke: {ATTACK}", f"File {ATTACK}"))
    make_cell(out, 4, returns=(0.0,), status=RUNNING)
    (make_cell(out, 5) / "cell.json").write_text("{")
    return report(out)


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


def test_claims_with_data_are_told_apart_from_those_that_lack_some() -> None:
    rule = Rule("higher", "difference of means", "supported above 0", ("codesign-bench run",), judge=lambda *_: told)
    told = Finding("supported", 0.5, 0.25, 0.75, n="6 and 6 seeds", note="clear")
    lacking = Finding("undecided", math.nan, note="no seeds")
    shown = part(
        [
            Row(Claim("one", "A beats B.", "figure 1", rule), told),
            Row(Claim("two", "C beats D.", "figure 1", rule), lacking, ("codesign-bench run",)),
        ]
    )
    assert shown.table is not None
    assert list(shown.table.rows) == [
        ("supported", "A beats B.", "0.50 [0.25, 0.75]", "6 and 6 seeds", "higher", "clear"),
    ]
    assert shown.rules is not None
    assert list(shown.rules.rows) == [("higher", "difference of means", "supported above 0")]
    assert shown.lacking is not None
    assert list(shown.lacking.rows) == [("C beats D.", "no seeds")]
    assert shown.commands == ["codesign-bench run"]


def test_figures_lie_in_the_page_with_their_numbers(page: str) -> None:
    pictures = [address for address in Reader(page).addresses if address.startswith("data:image/png;base64,")]
    assert len(pictures) == 3  # learning curves, as means and as interquartile means, and final results
    assert base64.b64decode(pictures[0].partition(",")[2]).startswith(b"\x89PNG")
    numbers, *_ = (address for address in Reader(page).addresses if address.startswith("data:text/csv;base64,"))
    table = base64.b64decode(numbers.partition(",")[2]).decode()
    assert table.startswith("task,method,quantity,env_steps,mean,standard_error,seeds\n")
    assert "reach,gnn_ppo,return_mean,100.0,3.0," in table


def test_figures_that_are_missing_are_named_with_the_reason(page: str) -> None:
    assert "design_sensitivity left out: not measured yet" in Reader(page).text


def test_cells_are_counted_by_status_and_damaged_ones_named(page: str) -> None:
    text = Reader(page).text
    assert "5: 3 done, 1 failed, 1 interrupted" in text
    assert "reach/gnn_ppo/default/seed-05" in text.split("Not readable")[1].split("every cell")[0]


def test_final_values_count_finished_cells_alone(tmp_path: Path) -> None:
    for seed, final in enumerate((1.0, 2.0, 6.0)):
        make_cell(tmp_path, seed, returns=(9.0, final))
    make_cell(tmp_path, 3, returns=(0.0, 100.0), status=FAILED)
    make_cell(tmp_path, 0, returns=(4.0,), variant=Variant.of(alpha=0.3))
    default, traded = task_results(read_cells(tmp_path)[0], load_results(tmp_path))
    (method,) = default.methods
    assert (default.variant, traded.variant) == ("default", "alpha-0.30")
    assert (method.seeds, method.unfinished, method.env_steps) == (3, 1, "0k")
    assert method.returns.values == (1.0, 2.0, 6.0)
    assert method.returns.mean == pytest.approx(3.0)
    assert method.successes.values == pytest.approx((0.1, 0.2, 0.6))
    assert default.return_axis == (1.0, 6.0)
    assert traded.methods[0].returns.text == "4.00"


def test_methods_with_different_budgets_are_ranked_with_a_caution(tmp_path: Path) -> None:
    for method, evaluations in (("gnn_ppo", 2), ("cma_es", 3)):
        for seed in range(3):
            make_cell(tmp_path, seed, returns=[1.0] * evaluations, method=method)
    (result,) = task_results(read_cells(tmp_path)[0], load_results(tmp_path))
    assert "different budgets" in result.verdict
    (alone,) = task_results(
        [cell for cell in read_cells(tmp_path)[0] if cell.method == "cma_es"], load_results(tmp_path)
    )
    assert "different budgets" not in alone.verdict


def test_an_estimate_has_an_interval_from_three_seeds_on() -> None:
    assert estimate([1.0, 3.0], generator(0, "two")).text == "2.00"
    assert not estimate([1.0, 3.0], generator(0, "two")).has_interval
    assert estimate([-2.0, -2.0, -2.0], generator(0, "three")).text == "−2.00 [−2.00, −2.00]"  # noqa: RUF001


def test_marks_stand_where_the_values_are() -> None:
    drawn = strip(estimate([0.0, 0.5, 1.0], generator(0, "three")), (0.0, 1.0))
    assert drawn.dots == [STRIP_MARGIN, STRIP_WIDTH / 2.0, STRIP_WIDTH - STRIP_MARGIN]
    assert drawn.mean == STRIP_WIDTH / 2.0
    assert STRIP_MARGIN <= drawn.low < drawn.mean < drawn.high <= STRIP_WIDTH - STRIP_MARGIN


def test_a_strip_without_width_puts_its_dots_in_the_middle() -> None:
    assert strip(estimate([2.0], generator(0, "one")), (2.0, 2.0)).dots == [STRIP_WIDTH / 2.0]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (
            {"A": [1.0, 1.0, 1.0], "B": [5.0, 5.0, 5.0], "C": [0.0, 0.0, 0.0]},
            "Highest final return: B, 5.00 [5.00, 5.00]; next: A, 1.00 [1.00, 1.00]. "
            "Difference: 4.00 [4.00, 4.00]; in 100% of pairs of seeds the first is above. The first is ahead.",
        ),
        (
            {"A": [0.0, 6.0, 9.0], "B": [4.0, 4.0, 4.0]},
            "Highest final return: A, 5.00 [0.00, 9.00]; next: B, 4.00 [4.00, 4.00]. "
            "Difference: 1.00 [\N{MINUS SIGN}4.00, 5.00]; in 67% of pairs of seeds the first is above. "
            "The interval holds 0: the order may be chance.",
        ),
        (
            {"A": [5.0, 5.0], "B": [1.0, 1.0, 1.0]},
            "Highest final return: A, 5.00; next: B, 1.00 [1.00, 1.00]. "
            "Fewer than 3 seeds give no interval: too little to rank them.",
        ),
        ({"A": [5.0, 6.0, 7.0]}, "One method alone: nothing to compare it with."),
    ],
)
def test_the_verdict_says_how_sure_the_order_is(values: dict[str, list[float]], expected: str) -> None:
    assert verdict([(label, estimate(numbers, generator(0, label))) for label, numbers in values.items()]) == expected


def test_settings_that_differ_between_cells_get_a_line_for_each_value(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    make_cell(tmp_path, 1)
    tuned = config(8, "tuned", clip=Sourced(0.2, "default"))
    make_cell(tmp_path, 0, task="weave", config=tuned, versions={"python": "3.11.7"})
    cells, _ = read_cells(tmp_path)
    (configuration,) = configurations(cells)
    assert list(configuration.table.rows) == [
        ("steps", "1000", "default", "all"),
        ("epochs", "4", "default", "reach"),
        ("epochs", "8", "tuned", "weave"),
        ("clip", "0.2", "default", "weave"),
    ]
    assert ("torch", "not installed", "weave") in version_table(cells).rows


def test_cells_that_nothing_but_their_seed_tells_apart_are_named(tmp_path: Path) -> None:
    for seed, epochs in enumerate((4, 4, 4, 8)):
        make_cell(tmp_path, seed, config=config(epochs))
    (configuration,) = configurations(read_cells(tmp_path)[0])
    assert [row[3] for row in configuration.table.rows] == [
        "all",
        "reach/gnn_ppo/default/seed-00, reach/gnn_ppo/default/seed-01 and 1 more",
        "reach/gnn_ppo/default/seed-03",
    ]


def test_a_folder_in_which_nothing_is_finished_still_gives_a_page(tmp_path: Path) -> None:
    make_cell(tmp_path / "runs", 0, status=FAILED, failure=Failure("no luck", "line 1\nline 2"))
    with cell_lock(make_cell(tmp_path / "runs", 1, status=RUNNING, timings=Timings())):
        text = Reader(report(tmp_path / "runs")).text
    assert "1 failed, 1 running" in text
    assert "No cell has finished yet" in text
    assert "No claim was judged: no finished cell" in text
    assert "No figure can be drawn from these results yet" in text
    assert "line 1\nline 2" in text


def test_a_cell_file_without_the_usual_parts_is_named_as_unreadable(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    for seed, damage in enumerate(
        ({"config": {}}, {"config": {"run": {"steps": 5}, "method": {}}}, {"host": "desk"}), 1
    ):
        path = make_cell(tmp_path, seed) / CELL_FILE
        path.write_text(json.dumps({**json.loads(path.read_text()), **damage}))
    cells, damaged = read_cells(tmp_path)
    assert [cell.name[-7:] for cell in cells] == ["seed-00"]
    assert [name[-7:] for name in damaged] == ["seed-01", "seed-02", "seed-03"]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--results", "nowhere"), "nowhere"),
        (("--results", "empty"), "no cells in 'empty'"),
        (("--results", "runs", "--out", "report.pdf"), ".html"),
        (("--results", "runs", "--out", "folder.html"), "folder.html"),
        (("--results", "runs", "--out", "runs/reach/gnn_ppo/default/seed-00/cell.json/report.html"), "cannot write"),
    ],
)
def test_bad_input_is_named_in_a_line(
    arguments: tuple[str, ...],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    make_cell(tmp_path / "runs", 0)
    (tmp_path / "empty").mkdir()
    (tmp_path / "folder.html").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main(["report", *arguments]) == 2
    told = capsys.readouterr().err.strip()
    assert named in told
    assert "\n" not in told
    assert not (tmp_path / "results").exists()


def test_the_command_writes_the_page_and_tells_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_cell(tmp_path / "runs", 0)
    out = tmp_path / "new" / "report.html"
    assert main(["report", "--results", str(tmp_path / "runs"), "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(out)]
    assert out.read_text(encoding="utf-8").rstrip().endswith("</html>")


def test_backticks_become_code_and_the_rest_stays_text() -> None:
    assert code_spans("the figure `a<b` & more") == "the figure <code>a&lt;b</code> &amp; more"
    assert code_spans("one ` alone <b>") == "one ` alone &lt;b&gt;"


def git(folder: Path, *arguments: str) -> None:
    """Run git in `folder` as somebody."""
    somebody = ("-c", "user.name=a", "-c", "user.email=a@example.com")
    subprocess.run(["git", *somebody, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_commit_is_told_where_the_code_is_a_checkout_and_nowhere_else(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    version = f"codesign-bench {codesign_bench.__version__}"
    git(tmp_path, "init")
    assert code_version(package) == version  # another project's checkout, with the package in its environment
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--message", "one")
    assert code_version(package).startswith(f"{version}, commit ")
    assert "not committed" not in code_version(package)
    (package / "__init__.py").write_text("changed = True\n")
    assert code_version(package).endswith("not committed")


def test_no_curves_give_no_final_values(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    assert task_results(read_cells(tmp_path)[0], pd.DataFrame(columns=["task", "method", "variant", "seed"])) == []

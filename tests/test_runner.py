"""A sweep runs what is missing, records what fails, refuses what differs, and never uses more cores than there are."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from codesign_bench import load_policy, load_results
from codesign_bench.cell.cell import Cell, check_cells, grid, parse_seeds
from codesign_bench.console import duration
from codesign_bench.errors import UserError
from codesign_bench.storage.files import write_json
from codesign_bench.storage.results import CHECKPOINT_FILE, PROGRESS_FILE, open_folder, read_cell
from codesign_bench.sweep.progress import ProgressDisplay
from codesign_bench.sweep.runner import make_plan, run_sweep, split_cores

pytestmark = pytest.mark.usefixtures("toy")

CELL = Cell("toy_reach", "toy_search", seed=0, steps=200, overrides=("evaluations=4",))


def cells(seeds: int = 1, **changes: Any) -> list[Cell]:
    """Return toy cells of 200 steps and 4 evaluations."""
    given = {"steps": 200, "overrides": ("evaluations=4",), **changes}
    return list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(seeds), **given))


def sweep(wanted: list[Cell], out: Path, **options: Any) -> tuple[int, str]:
    """Run a sweep; return its exit code and what it printed."""
    console = Console(record=True, width=200, file=io.StringIO())
    code = run_sweep(wanted, out, console=console, **options)
    return code, console.export_text()


def stored(cell: Cell, out: Path) -> dict[str, Any]:
    content = read_cell(cell.folder(out))
    assert content is not None
    return content


def test_a_finished_cell_holds_curve_configuration_versions_and_policy(tmp_path: Path) -> None:
    code, text = sweep([CELL], tmp_path)
    assert code == 0, text
    frame = load_results(tmp_path)
    steps = frame["env_steps"].tolist()
    assert steps[0] == 0
    assert steps[-1] >= 200
    assert len(steps) == 5
    assert frame["env_steps"].is_monotonic_increasing
    assert frame["env_steps"].is_unique
    assert frame["wall_s"].is_monotonic_increasing
    content = stored(CELL, tmp_path)
    assert content["status"] == "done"
    assert content["config"]["run"]["steps"] == {"value": 200, "source": "--steps"}
    assert content["config"]["method"]["step_size"] == {"value": 0.3, "source": "toy paper, table 1"}
    assert content["env_steps"] == steps[-1]
    assert {"python", "numpy", "torch", "pymunk", "cma", "gymnasium", "codesign_bench"} <= set(content["versions"])
    assert content["timings"]["ended"] >= content["timings"]["started"]
    assert content["host"]["threads"] == 1
    left = {path.name for path in CELL.folder(tmp_path).iterdir()}
    assert left == {"cell.json", "curve.csv", "metrics.csv", "evaluation.csv", "policy.safetensors"}


def test_the_policy_on_disk_is_the_one_that_was_judged(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    folder = CELL.folder(tmp_path)
    observation = np.zeros((2, 6), dtype=np.float32)
    design = load_policy(folder).design(observation)
    assert design.shape == (2, 1)
    lengths = np.loadtxt(folder / "evaluation.csv", delimiter=",", skiprows=1, usecols=1)
    np.testing.assert_allclose(lengths, 0.1 + (design[0, 0] + 1.0) * 0.5 * 0.9)
    damaged = folder / "policy.safetensors"
    damaged.write_bytes(damaged.read_bytes()[:-3])
    with pytest.raises(UserError, match=r"policy\.safetensors"):
        load_policy(folder)


def test_a_second_run_skips_what_is_done_and_runs_what_is_new(tmp_path: Path) -> None:
    sweep(cells(1), tmp_path)
    before = (CELL.folder(tmp_path) / "curve.csv").read_bytes()
    code, text = sweep(cells(2), tmp_path)
    assert code == 0
    assert "2 cells, 1 of them done before" in text
    assert (CELL.folder(tmp_path) / "curve.csv").read_bytes() == before
    assert load_results(tmp_path)["seed"].unique().tolist() == [0, 1]


def test_the_curve_does_not_depend_on_the_number_of_jobs(tmp_path: Path) -> None:
    assert sweep(cells(2), tmp_path / "one", jobs=1)[0] == 0
    assert sweep(cells(2), tmp_path / "two", jobs=2)[0] == 0
    frames = [load_results(tmp_path / name).drop(columns="wall_s") for name in ("one", "two")]
    assert frames[0].equals(frames[1])


def test_a_cell_that_raises_is_recorded_and_the_rest_go_on(tmp_path: Path) -> None:
    broken = cells(1, overrides=("evaluations=4", "fail_at=50"))
    good = [Cell("toy_reach", "toy_search", seed=1, steps=100)]
    code, text = sweep([*broken, *good], tmp_path)
    assert code == 1
    assert "the toy broke" in text
    failed = stored(broken[0], tmp_path)
    assert failed["status"] == "failed"
    assert "RuntimeError: the toy broke" in failed["failure"]["traceback"]
    assert failed["env_steps"] >= 50
    assert stored(good[0], tmp_path)["status"] == "done"


def test_a_failed_cell_is_reported_and_retried_only_when_asked(tmp_path: Path) -> None:
    broken = cells(1, overrides=("evaluations=4", "fail_at=50"))
    sweep(broken, tmp_path)
    ended = stored(broken[0], tmp_path)["timings"]["ended"]
    code, text = sweep(broken, tmp_path)
    assert (code, "failed earlier" in text) == (1, True)
    assert stored(broken[0], tmp_path)["timings"]["ended"] == ended
    plan = make_plan(broken, tmp_path, retry_failed=True)
    assert plan.pending == broken


def test_a_process_that_is_killed_is_named_and_the_sweep_goes_on(tmp_path: Path) -> None:
    killed = cells(1, overrides=("evaluations=4", "die_at=50"))
    good = [Cell("toy_reach", "toy_search", seed=1, steps=100)]
    code, text = sweep([*killed, *good], tmp_path, jobs=1)
    assert code == 1
    assert "killed by SIGKILL" in stored(killed[0], tmp_path)["failure"]["message"]
    assert "killed by SIGKILL" in text
    assert stored(good[0], tmp_path)["status"] == "done"


def test_another_configuration_is_refused_with_the_difference(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    with pytest.raises(UserError, match="episodes: there 4, asked 5") as caught:
        make_plan(cells(2, overrides=("evaluations=4", "episodes=5")), tmp_path)
    assert CELL.name in str(caught.value)
    assert str(caught.value).count("\n") <= 1
    with pytest.raises(UserError, match="steps: there 200, asked 300"):
        make_plan(cells(1, steps=300), tmp_path)
    assert make_plan(cells(1, profile="quick"), tmp_path).done


def test_a_truncated_checkpoint_is_refused_before_anything_runs(tmp_path: Path) -> None:
    open_folder(tmp_path)
    folder = CELL.folder(tmp_path)
    folder.mkdir(parents=True)
    (folder / CHECKPOINT_FILE).write_bytes(b"\x10\x00")
    with pytest.raises(UserError, match=CHECKPOINT_FILE):
        sweep([CELL], tmp_path)
    assert not (folder / "cell.json").exists()


def test_the_grid_names_variants() -> None:
    found = list(grid(tasks=["push"], methods=["a", "b"], seeds=[0, 12], cutouts=[0.4, 0.125], alphas=[0.3]))
    assert len(found) == 8
    assert {cell.name for cell in found if cell.method == "a"} == {
        f"push/a/cutout-{cutout}_alpha-0.30/seed-{seed}" for cutout in ("0.40", "0.125") for seed in ("00", "12")
    }
    assert Cell("push", "a", 0).variant == "default"
    assert Cell.from_json(found[0].to_json()) == found[0]


@pytest.mark.parametrize(
    ("text", "seeds"), [("3", (0, 1, 2)), ("0,3,5", (0, 3, 5)), ("2-4", (2, 3, 4)), ("1,4-5,4", (1, 4, 5))]
)
def test_seeds(text: str, seeds: tuple[int, ...]) -> None:
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["0", "-1", "-3,2", "two", "4-2", "", "1,,2", "1.5"])
def test_bad_seeds(text: str) -> None:
    with pytest.raises(UserError, match="--seeds"):
        parse_seeds(text)


def test_a_task_without_positions_refuses_a_cutout(monkeypatch: pytest.MonkeyPatch) -> None:
    import toy

    from codesign_bench.task import Task

    monkeypatch.setattr(toy.ToyReach, "in_cutout", Task.in_cutout)
    with pytest.raises(UserError, match=r"--cutout.*toy_reach"):
        check_cells(cells(1, cutouts=[0.4]))


@pytest.mark.parametrize(
    ("cores", "count", "threads", "jobs", "used"),
    [
        (2, 30, 1, None, 2),
        (2, 30, 1, 1, 1),
        (2, 30, 1, 64, 2),
        (8, 3, 1, None, 3),
        (8, 30, 3, None, 2),
        (1, 5, 1, 4, 1),
    ],
)
def test_jobs_times_threads_never_exceeds_the_cores(
    cores: int, count: int, threads: int, jobs: int | None, used: int
) -> None:
    found, line = split_cores(cores, count, threads, jobs)
    assert found == used
    assert found * threads <= cores
    assert (jobs is not None and jobs * threads > cores) == ("would need more cores" in line)
    with pytest.raises(UserError, match="cores"):
        split_cores(cores, count, cores + 1, jobs)


def test_progress_adds_up_the_running_cells(tmp_path: Path) -> None:
    one, two = cells(2)
    display = ProgressDisplay(Console(file=io.StringIO()), tmp_path, {one: 200, two: 200})
    one.folder(tmp_path).mkdir(parents=True)
    content = {"updated": 1e12, "env_steps": 100, "steps": 200, "steps_per_second": 50.0}
    write_json(one.folder(tmp_path) / PROGRESS_FILE, content)
    found = display.snapshot()
    assert ([cell for cell, _ in found.running], found.finished, found.cells) == ([one], 0, 2)
    assert found.seconds_left == pytest.approx((100 + 200) / 50.0)
    assert found.line() == "0/2 cells ended, 1 running, 50 steps/s, about 6 s left"
    write_json(one.folder(tmp_path) / PROGRESS_FILE, {**content, "updated": 0.0})
    assert display.snapshot().running == []
    display.ended(one)
    assert display.snapshot().finished == 1


def test_durations() -> None:
    assert [duration(seconds) for seconds in (42, 600, 12_600)] == ["42 s", "10 min", "3.5 h"]


def test_the_cell_file_is_plain_json(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    text = (CELL.folder(tmp_path) / "cell.json").read_text()
    assert json.dumps(json.loads(text), indent=2) + "\n" == text

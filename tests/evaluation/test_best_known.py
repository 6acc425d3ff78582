"""Better episodes are found in policies, in headroom and by a search, and count once they were played again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import store_played_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.evaluation import best_known
from codesign_bench.evaluation.best_known import SCRIPT, SEARCH, Search, Update, update
from codesign_bench.evaluation.headroom import Budget, measure_cell
from codesign_bench.evaluation.plans import replay
from codesign_bench.storage.best_known import BestKnown, load_best_known, path_of
from codesign_bench.storage.cells import StoredCell, open_cell
from codesign_bench.storage.layout import POLICY_FILE
from codesign_bench.task import Behaviour, Task, load_task
from toy import ConstantPolicy, ToyReach

pytestmark = pytest.mark.usefixtures("toy")

NOTHING = Search(candidates=0)
SHORT = Search(candidates=48, popsize=6, sigma0=0.3, knots=2, neighbours=2)


@pytest.fixture
def task(toy: None) -> Task:
    return load_task("toy_reach")


def cell_of(out: Path, length: float, speed: float = 0.0, **fields: object) -> StoredCell:
    """Return a finished cell with one stick for all goals, both in [-1, 1]."""
    tensors = {"vector": np.array([length, speed])}
    return open_cell(store_played_cell(out, "toy_reach", "toy_search", tensors, **fields))


def assert_repeats(task: Task, known: BestKnown) -> None:
    """Check that every known episode is what its plan gives."""
    for instance, episodes in known.episodes.items():
        for one in episodes:
            again = replay(task, one.plan[None], task.evaluation_instances()[[instance]])
            assert (again.returns[0], again.successes[0], again.lengths[0]) == (one.earned, one.solved, one.length)


def returns(known: BestKnown) -> list[float]:
    """Return the best known return of every instance."""
    return [known.episodes[instance][0].earned for instance in sorted(known.episodes)]


def test_of_several_policies_the_best_counts_for_each_instance(task: Task, tmp_path: Path) -> None:
    cells = [cell_of(tmp_path, -1.0, seed=0), cell_of(tmp_path, 1.0, seed=1)]
    lines: list[str] = []
    known = update(tmp_path, task, cells, NOTHING, lines.append).known
    own = [pd.read_csv(cell.folder / "evaluation.csv")["return"] for cell in cells]
    assert returns(known) == pytest.approx(np.maximum(*own).tolist())
    assert_repeats(task, known)
    sources = {episode.source for (episode,) in known.episodes.values()}
    assert sources == {"toy_reach/toy_search/default/seed-00", "toy_reach/toy_search/default/seed-01"}
    assert lines == ["toy_reach: better episodes of 8 of 8 instances by 2 policies at hand"]
    assert returns(load_best_known(tmp_path, task)) == returns(known)


def test_nothing_is_played_where_a_policy_is_no_better(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cells = [cell_of(tmp_path, 0.0)]
    first = update(tmp_path, task, cells, NOTHING, [].append)
    before = path_of(tmp_path, "toy_reach").read_bytes()
    again = update(tmp_path, task, cells, NOTHING, [].append)
    assert (first.env_steps > 0, again.env_steps, again.improved) == (True, 0, set())
    assert path_of(tmp_path, "toy_reach").read_bytes() == before
    monkeypatch.setattr(best_known, "keeps_returns", lambda variant: False)
    assert update(tmp_path, task, cells, NOTHING, [].append).env_steps > 0, "its table does not say what it earns"


def test_a_policy_trained_for_another_reward_is_judged_by_the_tasks_own(task: Task, tmp_path: Path) -> None:
    cell = cell_of(tmp_path, 0.0, variant=Variant.of(alpha=0.3))
    known = update(tmp_path, task, [cell], NOTHING, [].append).known
    assert max(returns(known)) <= 0.0, "the trade-off would add up to 1 in each step"
    assert_repeats(task, known)


def test_tools_of_headroom_count_if_the_policy_is_the_one_that_was_measured(task: Task, tmp_path: Path) -> None:
    cell = cell_of(tmp_path, 1.0)
    path = measure_cell(cell.folder, tmp_path, Budget(candidates=30, popsize=6, random_tools=4), [].append)
    table = pd.read_csv(path)
    known = update(tmp_path, task, [cell], NOTHING, [].append).known
    assert returns(known) == pytest.approx(table["best_return"].tolist(), abs=1e-6)
    assert_repeats(task, known)
    assert "toy_reach/toy_search/default/seed-00, another tool" in {one.source for (one,) in known.episodes.values()}
    table.assign(policy="sha256:0").to_csv(path, index=False)
    own = pd.read_csv(cell.folder / "evaluation.csv")["return"]
    elsewhere = update(tmp_path / "new", task, [cell], NOTHING, [].append).known
    assert returns(elsewhere) == pytest.approx(own.tolist())


def test_cells_that_cannot_be_played_are_named_or_counted(task: Task, tmp_path: Path) -> None:
    without, damaged = cell_of(tmp_path, 0.0, seed=0), cell_of(tmp_path, 0.0, seed=1)
    (without.folder / POLICY_FILE).unlink()
    (damaged.folder / POLICY_FILE).write_bytes(b"no policy")
    lines: list[str] = []
    assert update(tmp_path, task, [without, damaged], NOTHING, lines.append).known.episodes == {}
    assert lines[0].startswith("passed over toy_reach/toy_search/default/seed-01: ")
    assert lines[1].endswith("by 1 policies at hand; 1 cells have none")


def test_a_script_counts_like_a_policy(task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def script(self: Task) -> Behaviour:
        return ConstantPolicy(np.array([0.0, 0.0]))

    monkeypatch.setattr(type(task), "script", script)
    known = update(tmp_path, task, [], NOTHING, [].append).known
    assert {one.source for (one,) in known.episodes.values()} == {SCRIPT}
    gaps = np.abs(task.evaluation_instances()[:, 0] - 0.55)
    assert returns(known) == pytest.approx((-gaps * np.where(gaps < 0.05, 1, 5)).tolist())


def test_a_search_finds_the_stick_that_touches_at_once_and_never_loses_anything(task: Task, tmp_path: Path) -> None:
    cells = [cell_of(tmp_path, 0.0)]
    before = update(tmp_path, task, cells, NOTHING, [].append).known
    start, lines = returns(before), list[str]()
    state = update(tmp_path, task, cells, SHORT, lines.append)
    after = returns(state.known)
    assert (np.array(after) >= np.array(start)).all()
    # A stick of 0.1 to 1 m that may move 0.1 m in its first step reaches every goal from 0 to 1 m.
    assert min(after) > -0.05
    assert all(one.solved for episodes in state.known.episodes.values() for one in episodes)
    assert_repeats(task, state.known)
    assert set(state.known.searched.values()) == {1 + 2 + 48}
    assert SEARCH in {one.source for (one,) in state.known.episodes.values()}
    assert sum(" -> " in line for line in lines) >= 6
    again = update(tmp_path, task, cells, SHORT, [].append, instances=3)
    assert sorted(again.known.searched.values()) == [51] * 5 + [102] * 3, "another search, of those searched least"
    assert (np.array(returns(again.known)) >= np.array(after)).all()


def test_without_anything_at_hand_a_search_starts_at_random(task: Task, tmp_path: Path) -> None:
    known = update(tmp_path, task, [], SHORT, [].append, instances=2).known
    assert sorted(known.episodes) == [0, 1]
    assert_repeats(task, known)


def test_an_interrupted_search_goes_on_with_the_instances_that_are_left(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored, store = list[int](), best_known.store

    def interrupted(results: Path, task: Task, known: BestKnown) -> None:
        store(results, task, known)
        stored.append(len(known.searched))
        if len(stored) == 4:
            raise KeyboardInterrupt

    monkeypatch.setattr(best_known, "store", interrupted)
    with pytest.raises(KeyboardInterrupt):
        update(tmp_path, task, [], SHORT, [].append)
    monkeypatch.setattr(best_known, "store", store)
    lines: list[str] = []
    known = update(tmp_path, task, [], SHORT, lines.append, instances=4).known
    assert sorted(known.searched) == list(range(8))
    assert max(known.searched.values()) < 2 * SHORT.candidates, "none was searched twice"


def test_neighbours_are_the_nearest_goals(task: Task) -> None:
    state = Update(task, BestKnown())
    goals = task.evaluation_instances()[:, 0]
    for index, near in enumerate(best_known._neighbours(state, 3)):
        gaps = np.abs(goals - goals[index])
        assert sorted(gaps[near].tolist()) == sorted(gaps.tolist())[1:4]
        assert index not in near


def test_what_is_bent_by_nothing_stays_as_it_is() -> None:
    bent = best_known._Bent(ToyReach(), 3)
    plan = np.array([0.5, -0.5, 0.0, 0.5, 1.0, 0.2], dtype=np.float32)
    numbers = bent.start(plan)
    np.testing.assert_array_equal(bent.plans(plan, numbers[None])[0], plan)
    # Knots at steps 0, 2 and 4: a change of 0.4 at the middle one is 0.2 halfway, and controls end at 1.
    changed = bent.plans(plan, np.array([[-1.0, 0.0, 0.4, 0.0]]))[0]
    assert changed == pytest.approx([-1.0, -0.5, 0.2, 0.9, 1.0, 0.2])

"""The table of best known episodes: what takes whose place, what is written, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from codesign_bench.storage import best_known
from codesign_bench.storage.best_known import BestKnown, Episode, load_best_known, path_of, store
from codesign_bench.storage.measurements import BEST_KNOWN_EPISODES
from codesign_bench.storage.reading import UnusableFile
from codesign_bench.storage.tables import read_table
from toy import ToyReach

TASK = ToyReach()


def episode(earned: float, solved: bool = False, instance: int = 0, source: str = "somebody") -> Episode:
    """Return an episode with a plan of its own."""
    plan = np.linspace(0.0, earned, 6, dtype=np.float32)
    return Episode(instance, earned, solved, 5, source, plan)


def known_of(*episodes: Episode) -> BestKnown:
    """Return what is known once these were offered."""
    known = BestKnown()
    for one in episodes:
        known.offer(one)
    return known


def test_only_what_is_better_takes_the_place_of_what_is_known() -> None:
    known = BestKnown()
    assert known.best(0) is None
    assert known.offer(episode(-1.0))
    assert not known.offer(episode(-1.0, source="another"))
    assert not known.offer(episode(-2.0))
    assert known.offer(episode(-0.5))
    assert [one.earned for one in known.episodes[0]] == [-0.5]


def test_the_best_that_solves_stays_beside_a_higher_return_that_does_not() -> None:
    known = known_of(episode(1.0, solved=True), episode(2.0))
    assert [(one.earned, one.solved) for one in known.episodes[0]] == [(2.0, False), (1.0, True)]
    known.offer(episode(1.5, solved=True))
    assert [(one.earned, one.solved) for one in known.episodes[0]] == [(2.0, False), (1.5, True)]
    known.offer(episode(2.0, solved=True))
    assert [(one.earned, one.solved) for one in known.episodes[0]] == [(2.0, True)]


def test_what_is_stored_comes_back_and_its_design_can_be_read(tmp_path: Path) -> None:
    known = known_of(episode(2.0), episode(1.0, solved=True), episode(-1.0, instance=3, source="a, b"))
    known.searched = {0: 12, 3: 5}
    store(tmp_path, TASK, known)
    again = load_best_known(tmp_path, TASK)
    assert again.searched == known.searched
    for instance, episodes in known.episodes.items():
        for one, other in zip(episodes, again.episodes[instance], strict=True):
            assert (one.earned, one.solved, one.length, one.source) == (
                *(other.earned, other.solved, other.length, other.source),
            )
            np.testing.assert_array_equal(one.plan, other.plan)
    table = read_table(path_of(tmp_path, "toy_reach"), BEST_KNOWN_EPISODES.form)
    assert table is not None
    assert table["design_length"].tolist() == [0.55] * 3, "the middle of 0.1 to 1 m"
    goals = TASK.evaluation_instances()[:, 0]
    assert table["instance_goal"].tolist() == [goals[0], goals[0], goals[3]]


def test_two_processes_keep_the_better_of_both(tmp_path: Path) -> None:
    store(tmp_path, TASK, known_of(episode(2.0), episode(1.0, instance=1)))
    mine = known_of(episode(1.0), episode(3.0, instance=1))
    store(tmp_path, TASK, mine)
    again = load_best_known(tmp_path, TASK)
    for known in (mine, again):
        assert {index: one.earned for index, (one,) in known.episodes.items()} == {0: 2.0, 1: 3.0}
    arrays = best_known.load_arrays(path_of(tmp_path, "toy_reach").with_suffix(".safetensors"))[0]
    assert set(arrays) == {one.name for (one,) in again.episodes.values()}, "plans that nobody names are gone"


def test_a_kill_between_both_files_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store(tmp_path, TASK, known_of(episode(1.0)))

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(best_known, "write_table", killed)
    with pytest.raises(KeyboardInterrupt):
        store(tmp_path, TASK, known_of(episode(2.0)))
    (kept,) = load_best_known(tmp_path, TASK).episodes[0]
    assert kept.earned == 1.0


def test_another_version_of_the_scene_knows_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store(tmp_path, TASK, known_of(episode(1.0)))
    monkeypatch.setattr(ToyReach, "version", 2)
    assert load_best_known(tmp_path, TASK).episodes == {}
    store(tmp_path, TASK, known_of(episode(0.5)))
    assert pd.read_csv(path_of(tmp_path, "toy_reach"))["task_version"].tolist() == [2]


@pytest.mark.parametrize("damage", ["missing", "truncated", "plan", "instance"])
def test_damage_is_named_and_nothing_is_overwritten(damage: str, tmp_path: Path) -> None:
    store(tmp_path, TASK, known_of(episode(1.0)))
    path = path_of(tmp_path, "toy_reach")
    plans, table = path.with_suffix(".safetensors"), pd.read_csv(path)
    if damage == "missing":
        plans.unlink()
    elif damage == "truncated":
        plans.write_bytes(plans.read_bytes()[:-1])
    else:
        table.assign(**{damage: "plan-0" if damage == "plan" else 8}).to_csv(path, index=False)
    before = path.read_bytes()
    with pytest.raises(UnusableFile, match="toy_reach"):
        load_best_known(tmp_path, TASK)
    with pytest.raises(UnusableFile):
        store(tmp_path, TASK, known_of(episode(2.0)))
    assert path.read_bytes() == before

"""Each method is what it says: the baselines' limits are real, and so is their strength.

This file names methods; what holds for all of them is in `test_contract.py`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.config.profiles import profiles
from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.evaluation.reference_points import single_tool
from codesign_bench.learning.actor import Actor
from codesign_bench.method import Method, Problem, load_method
from codesign_bench.registry import built_in
from codesign_bench.seeding import Streams
from codesign_bench.task import Singles, Task, load_task, task_names
from codesign_bench.task.episodes import Episodes
from tolerances import DOUBLE, of_sum

MakeMethod = Callable[..., Method[Any]]
PPO_BASED = ("gnn_ppo", "shared_arch", "hwasp_minimal")
BUDGET = 10_000
RATES = {"policy_learning_rate", "value_learning_rate"}
DESIGN = {"design_credit", "design_learning_rate", "design_kl_threshold"}
SEARCHED = {
    *("batch_size", "minibatch_size", "epochs", "kl_threshold", "control_log_std", "gamma", "gae_lambda", "clip_ratio"),
    *RATES,
}
TOLD = {
    ("shared_arch", "paper"): RATES,  # The paper's table of baselines prints their rates, one for all tasks.
    ("cma_rl", "paper"): RATES,
    ("cma_rl", "laptop"): SEARCHED,  # by the common search, on push
    ("cma_rl", "workstation"): SEARCHED,
    ("hwasp_minimal", "workstation"): DESIGN,
    ("hwasp_minimal", "laptop"): DESIGN,  # A bare vector needs larger steps than a network (ours).
    ("hwasp_minimal", "quick"): DESIGN,
}
"""In what a baseline differs from the paper's own method on some task, of the settings that both have."""


def starts(task: Task, count: int = 16) -> Singles:
    """Return observations (B, O) of the design phase for different goals."""
    episodes = Episodes(task, count)
    episodes.begin(np.arange(count), task.sample_instances(np.random.default_rng(1), count))
    return episodes.observation.copy()


def trained(make_method: MakeMethod, name: str) -> Method[Any]:
    """Return a method after two small batches."""
    method = make_method(name)
    for _ in range(2):
        method.train(BUDGET)
    return method


@pytest.mark.parametrize("name", ["cma_rl", "hwasp_minimal", "cma_es", "bo_rl"])
def test_the_one_design_for_all_goals_is_learned(make_method: MakeMethod, push: Task, name: str) -> None:
    designs = trained(make_method, name).policy().design(starts(push))
    assert designs[0].any(), "it has moved from the middle of the design space"


@pytest.mark.parametrize("name", ["gnn_ppo", "shared_arch", "cma_rl", "hwasp_minimal", "bo_rl"])
def test_controllers_see_the_goal_and_the_design(make_method: MakeMethod, push: Task, name: str) -> None:
    policy, layout = trained(make_method, name).policy(), push.layout
    seen = np.repeat(starts(push, 1), 3, axis=0)
    seen[:, layout.phase] = (0.0, 1.0, 0.0)
    seen[1, layout.goal] += 1.0
    seen[2, layout.design] = 0.5
    controls = policy.act(seen)
    assert not np.array_equal(controls[0], controls[1])
    assert not np.array_equal(controls[0], controls[2])


def test_the_single_trajectory_is_open_loop(make_method: MakeMethod, push: Task) -> None:
    policy, layout = trained(make_method, "cma_es").policy(), push.layout
    rng = np.random.default_rng(0)
    seen = rng.normal(size=(push.horizon, layout.size)).astype(np.float32)
    seen[:, layout.phase.stop - 1] = np.arange(push.horizon, dtype=np.float32) / np.float32(push.horizon)
    other = seen.copy()
    other[:, : layout.phase.stop - 1] = 0.0
    np.testing.assert_array_equal(policy.act(seen), policy.act(other))
    plan = policy.tensors()["plan"]
    assert plan.size == push.design_space.size + push.horizon * push.control_space.size
    for acted, planned in ((policy.act(seen).ravel(), plan[push.design_space.size :]), (policy.design(seen[0]), plan)):
        np.testing.assert_array_equal(acted, np.float32(planned[: acted.size]))


def test_a_given_tool_is_the_one_that_is_used_for_every_goal(push: Task) -> None:
    given, method_class = (0.25, -0.5, 0.0, 1.0, -1.0), load_method("fixed_tool")
    config = replace(method_class.config_class(), **method_class.small(), unit_design=given)
    method = method_class(Problem(push), config, Streams(0))
    method.train(1_000)
    for acted in (method.policy().design(starts(push)), method.learner.collect(400, 2).design[:, 0]):
        np.testing.assert_array_equal(acted, np.float32(given) * np.ones((len(acted), 1), np.float32))
    with pytest.raises(UserError, match=r"unit_design has 2 numbers; the tools of 'push' have 5"):
        resolve(method_class, "push", "laptop", ["unit_design=0,0"])


@pytest.mark.slow
@pytest.mark.parametrize("name", built_in("tasks"))
def test_the_tool_that_is_given_does_most_on_instances_that_judge_nobody(name: str) -> None:
    task = load_task(name)
    given = resolve(load_method("fixed_tool"), name, "laptop").method.unit_design
    np.testing.assert_allclose(given, single_tool(task, task.validation_instances()), atol=6e-4)


def test_contextual_cma_gives_every_goal_its_tool(make_method: MakeMethod, push: Task) -> None:
    method: Any = trained(make_method, "contextual_cma")
    while method.search.generations < 2:
        method.train(BUDGET)
    designs = method.policy().design(starts(push))
    assert len(np.unique(designs, axis=0)) == len(designs)
    batch = method.learner.collect(2_000, 4)
    begun = batch.is_design & batch.valid
    away = batch.design[begun] - method.policy().design(batch.observation[begun])
    # Drawn around the means with the deviation of the search: four of them are hardly ever exceeded.
    assert 0.0 < np.abs(away).max() < 4.0 * method.search.sigma * np.sqrt(np.diag(method.search.covariance)).max()


def test_a_climbed_design_is_liked_better_by_the_critic_than_those_it_started_from(
    make_method: MakeMethod, push: Task
) -> None:
    policy: Any = trained(make_method, "critic_design").policy()
    goals = starts(push)
    designs = policy.design(goals)
    assert len(np.unique(designs, axis=0)) > 1
    for observation, design in zip(torch.from_numpy(goals), torch.from_numpy(designs), strict=True):
        with torch.no_grad():
            assert policy.values(observation, design[None]) > policy.values(observation, policy.starts()).max()


def test_the_critic_is_asked_for_the_state_after_the_design_step(make_method: MakeMethod, push: Task) -> None:
    policy: Any = trained(make_method, "critic_design").policy()
    episodes, given = Episodes(push, 1), np.linspace(-0.8, 0.8, push.design_space.size, dtype=np.float32)
    episodes.begin(np.arange(1), push.sample_instances(np.random.default_rng(1), 1))
    before = torch.from_numpy(episodes.observation[0].copy())
    episodes.design(np.arange(1), given[None])
    with torch.no_grad():
        expected = policy.value(torch.from_numpy(episodes.observation.astype(np.float32)))
        found = policy.values(before.float(), torch.from_numpy(given)[None])
    # All that changes besides is where the tool is held so that it is clear of the puck.
    assert float(found) == pytest.approx(float(expected), abs=0.2)


def test_searched_and_random_tools_take_turns_after_the_initial_ones(make_method: MakeMethod) -> None:
    method: Any = make_method("coadaptation", initial_designs=2)
    tools, searched = [method.current.unit_design.clone()], []
    for _ in range(5):
        searched.append("promised_value" in method.train(BUDGET).metrics)
        tools.append(method.current.unit_design.clone())
    assert searched == [False, True, False, True, False]
    assert not tools[0].any()
    assert len(torch.unique(torch.stack(tools), dim=0)) == len(tools)
    assert (method.designs, method.returns, method.own_steps) == (6, [], 0)


def test_a_searched_tool_is_the_one_that_the_populations_critic_promises_most(make_method: MakeMethod) -> None:
    method: Any = make_method("coadaptation", initial_designs=1, swarm_size=100, swarm_iterations=30)
    before = method.streams["starts"].bit_generator.state
    promised = method.train(BUDGET).metrics["promised_value"] / method.reward_scale()
    method.streams["starts"].bit_generator.state = before
    values = method.promised(method.starts())
    assert values(method.current.unit_design.double().numpy()[None]) == pytest.approx(promised, abs=1e-5)
    assert method.reward_scale() == pytest.approx(np.sqrt((method.buffer.held.reward.astype(float) ** 2).mean()))
    others = np.random.default_rng(0).uniform(-1.0, 1.0, (300, method.current.unit_design.numel()))
    assert promised > values(others).max() > values(others).min()


def test_starts_are_first_control_steps_and_only_their_design_is_replaced(make_method: MakeMethod, push: Task) -> None:
    method: Any = make_method("coadaptation")
    method.train(BUDGET)
    starts = method.starts()
    elapsed = push.layout.phase.stop - 1
    assert starts.shape == (method.config.stored_starts, push.layout.size)
    assert not starts[:, elapsed].any()
    design = np.linspace(-0.5, 0.5, push.design_space.size)
    seen = starts.clone()
    seen[:, push.layout.design] = torch.from_numpy(design).float()
    with torch.no_grad():
        expected = method.population.critic(seen, method.population.actor.control(seen)).amin(0).mean()
    found = method.promised(starts)(np.stack([0.0 * design, design]))
    assert found[1] == pytest.approx(float(expected), abs=1e-5)
    assert found[0] != found[1]


def test_the_population_is_trained_from_the_fourth_tool_on_and_every_tool_starts_from_it(
    make_method: MakeMethod,
) -> None:
    method: Any = make_method("coadaptation")
    untrained = {name: tensor.clone() for name, tensor in method.population.critic.state_dict().items()}
    for tool in range(1, 6):
        assert method.designs == tool
        trained = "population_critic_loss" in method.train(BUDGET).metrics
        assert trained == (tool > 3)
        same = all(torch.equal(tensor, untrained[n]) for n, tensor in method.population.critic.state_dict().items())
        assert same == (tool <= 3)
        for name, network in method.individual.modules.items():
            for key, tensor in network.state_dict().items():
                assert torch.equal(tensor, method.population.modules[name].state_dict()[key])


def test_the_policy_is_the_tool_that_earned_most_in_its_later_half_with_its_actor(
    make_method: MakeMethod, push: Task
) -> None:
    method: Any = make_method("coadaptation")

    def given_up(tool: float, returns: list[float]) -> float:
        method.current.unit_design.fill_(tool)
        method.returns = returns
        method.keep_the_better()
        return float(method.policy().design(starts(push))[0, 0])

    assert given_up(0.25, [9.0, 9.0, 1.0, 1.0]) == 0.25
    controls = method.policy().act(starts(push))
    with torch.no_grad():
        method.individual.actor.mlp[-1].bias.add_(1.0)
    assert given_up(0.5, [5.0, 5.0, 0.0, 0.5]) == 0.25
    np.testing.assert_array_equal(method.policy().act(starts(push)), controls)
    assert given_up(-0.75, [0.0, 0.0, 2.0, 2.0]) == -0.75
    assert (method.policy().act(starts(push)) > controls).all()


def test_an_archive_holds_the_best_plan_of_every_cell(push: Task) -> None:
    method_class = load_method("pt_me")
    method: Any = method_class(Problem(push), replace(method_class.config_class(), **method_class.small()), Streams(0))
    before = method.archive.returns.copy()
    for _ in range(30):
        report = method.train(100_000)
        assert (method.archive.returns >= before).all()
        assert 4 * 2 <= report.env_steps <= 4 * (push.horizon + 1)
        before = method.archive.returns.copy()
    archive, policy = method.archive, method.policy()
    assert archive.filled.all()
    # Played again on its own instance, an elite gets its return again: the policy finds its design and its controls.
    episodes, slots = Episodes(push, len(archive.returns)), np.arange(len(archive.returns))
    box = push.instance_space
    low, high = np.array(box.low), np.array(box.high)
    episodes.begin(slots, 0.5 * (low + high) + archive.instances * 0.5 * (high - low))
    episodes.design(slots, policy.design(episodes.observation))
    returns, active = np.zeros(len(slots)), slots
    while active.size:
        reward, terminated, truncated = episodes.control(active, policy.act(episodes.observation[active]))
        returns[active] += reward
        active = active[~(terminated | truncated)]
    np.testing.assert_allclose(returns, archive.returns, atol=1e-3)


def searched(push: Task, **changes: Any) -> tuple[Any, list[Any]]:
    """Return a small `bo_rl` after its budget, and the batches that it reported."""
    method_class = load_method("bo_rl")
    config = replace(method_class.config_class(), **{**method_class.small(), **changes})
    method, left, reports = method_class(Problem(push), config, Streams(0)), 12_000, []
    while left > 0:
        reports.append(method.train(left))
        left -= reports[-1].env_steps
    return method, reports


def test_bayesian_optimisation_splits_its_budget_evenly_and_ends_with_the_best_candidate(push: Task) -> None:
    method, reports = searched(push, candidates=4, first_candidates=2, search_share=0.5)
    judged = [int(report.metrics["candidates"]) for report in reports]
    steps = {
        count: sum(r.env_steps for r, c in zip(reports, [0, *judged], strict=False) if c == count) for count in range(5)
    }
    # A candidate takes 1/8 of the budget, in whole episodes; the rest is the best one's.
    assert len(method.scores) == 4
    assert [steps[count] for count in range(4)] == pytest.approx([1_500] * 4, abs=150)
    assert steps[4] == sum(report.env_steps for report in reports) - sum(steps[count] for count in range(4)) > 4_000
    best = method.designs[np.argmax(method.scores)]
    np.testing.assert_allclose(method.policy().design(starts(push)), np.tile(best, (len(starts(push)), 1)), rtol=1e-6)
    assert len(np.unique(method.designs, axis=0)) == 4


def test_each_candidate_gets_a_new_controller_and_the_best_one_is_kept(push: Task) -> None:
    method_class = load_method("bo_rl")
    method: Any = method_class(Problem(push), replace(method_class.config_class(), **method_class.small()), Streams(0))
    begun, kept = [], []
    while len(method.scores) < 3:
        weights = method.learner.policy().tensors()["controller.0.weight"]
        if len(begun) == len(method.scores):
            begun.append(weights)
        method.train(10_000)
        if len(kept) < len(method.scores):
            kept.append(method.policy().tensors())
    assert not any(np.array_equal(first, other) for first, other in itertools.combinations(begun, 2))
    # Between candidates the policy is that of the best so far.
    for count, (before, after) in enumerate(itertools.pairwise(kept), start=2):
        better = method.scores[count - 1] > max(method.scores[: count - 1])
        assert better != all(np.array_equal(before[name], after[name]) for name in before)


@pytest.mark.parametrize("more", [1, 4, 7])
def test_a_batch_that_passes_a_candidates_share_leaves_the_candidate_to_be_judged(
    make_method: MakeMethod, more: int
) -> None:
    share = 600 + more  # The first batch of 600 is not the judging one, and its whole episodes may pass the share.
    method: Any = make_method("bo_rl", candidates=2, search_share=1.0, batch_size=600)
    left = 2 * share
    while left > 0 and method._searching:
        left -= method.train(left).env_steps
    assert len(method.scores) == 2


def test_random_tools_are_drawn_anew_in_every_episode_and_the_middle_one_is_used(push: Task) -> None:
    method_class = load_method("random_tool")
    method = method_class(Problem(push), replace(method_class.config_class(), **method_class.small()), Streams(0))
    batch = method.learner.collect(2_000, 4)
    designs = batch.design[batch.is_design & batch.valid]
    assert len(np.unique(designs, axis=0)) == len(designs) > 8
    assert (np.abs(designs) <= 1.0).all()
    np.testing.assert_array_equal(method.policy().design(starts(push)), 0.0)


@pytest.mark.parametrize(("limit", "same"), [(0.0, True), (1.0, False)])
def test_a_leader_that_expects_no_response_is_the_designer_of_gnn_ppo(
    make_method: MakeMethod, limit: float, same: bool
) -> None:
    leading: Any = make_method("stackelberg_ppo", response_limit=limit, fix_std=False)
    plain: Any = make_method("gnn_ppo", design_credit="separate", fix_std=False)
    for _ in range(3):
        leading.train(BUDGET)
        plain.train(BUDGET)
    arrays, others = leading.state().arrays, plain.state().arrays
    assert arrays.keys() == others.keys()
    equal = all(np.array_equal(array, others[name]) for name, array in arrays.items())
    assert equal == same
    assert leading.learner.actor.design_log_std.requires_grad


def test_a_leader_has_separate_credit_alone() -> None:
    with pytest.raises(UserError, match="expected one of separate"):
        resolve(load_method("stackelberg_ppo"), "push", "laptop", ["design_credit=joint"])


@pytest.mark.parametrize("name", PPO_BASED)
def test_the_paper_trains_both_phases_jointly(push: Task, name: str) -> None:
    assert resolve(load_method(name), push.name, "paper").method.design_credit == "joint"


@pytest.mark.parametrize(
    ("profile", "label"), [("paper", "GNN-PPO, joint credit"), ("laptop", "GNN-PPO, joint credit")]
)
def test_figures_tell_the_papers_method_from_our_variant_of_it(profile: str, label: str) -> None:
    method_class = load_method("gnn_ppo")
    assert method_class.label_of(resolve(method_class, "push", profile).method) == label


@pytest.mark.parametrize("profile", profiles())
@pytest.mark.parametrize("name", ["shared_arch", "hwasp_minimal", "cma_rl"])
def test_baselines_share_the_settings_of_the_papers_method_unless_told(name: str, profile: str) -> None:
    differing = set()
    for task_name in task_names():
        ours, theirs = (asdict(resolve(load_method(each), task_name, profile).method) for each in ("gnn_ppo", name))
        differing |= {setting for setting in ours.keys() & theirs.keys() if ours[setting] != theirs[setting]}
    assert differing == TOLD.get((name, profile), set())


def count(parameters: Any) -> int:
    """Return how many numbers are trained among the parameters of a module."""
    return sum(parameter.numel() for parameter in parameters if parameter.requires_grad)


@pytest.mark.parametrize("profile", profiles())
@pytest.mark.parametrize("task_name", task_names())
def test_the_shared_architecture_has_at_least_as_many_parameters(task_name: str, profile: str) -> None:
    task, policies, wholes = load_task(task_name), [], []
    for name in ("gnn_ppo", "shared_arch"):
        method_class: Any = load_method(name)
        config, streams = resolve(method_class, task_name, profile).method, Streams(0)
        actor: Actor = method_class.make_actor(task, config, streams["policy weights"])
        value: torch.nn.Module = method_class.make_value(task, config, streams["value weights"])
        policies.append(count(actor.parameters()))
        wholes.append(count(actor.parameters()) + count(value.parameters()))
    assert policies[1] >= policies[0]
    assert wholes[1] >= wholes[0]


def test_cma_rl_judges_every_candidate_by_its_mean_return_on_the_same_instances(make_method: MakeMethod) -> None:
    method: Any
    twin: Any
    method, twin = (make_method("cma_rl", batch_size=2_000) for _ in range(2))
    candidates = np.float32(method.evolution.ask())
    report = method.train(BUDGET)
    (fitness,) = method.evolution.history
    _, batch = twin.learner.train(BUDGET)  # The same seed: the batch that the method was trained on.
    returns: list[dict[bytes, float]] = [{} for _ in candidates]
    for slot in range(len(batch.valid)):
        begins = np.flatnonzero(batch.is_design[slot]).tolist()
        for begin, end in zip(begins, [*begins[1:], batch.valid.shape[1]], strict=True):
            (candidate,) = np.flatnonzero((candidates == batch.design[slot, begin]).all(axis=1))
            goal = batch.observation[slot, begin].tobytes()
            returns[candidate][goal] = float(batch.reward[slot, begin:end].sum())
    common = set.intersection(*(set(of_candidate) for of_candidate in returns))
    assert report.metrics["fitness_instances"] == len(common) > 1
    expected = [np.mean([of_candidate[goal] for goal in common]) for of_candidate in returns]
    tolerance = of_sum(batch.env_steps, np.abs(batch.reward).sum(), DOUBLE)  # Rewards are added up in any order.
    np.testing.assert_allclose(fitness, expected, rtol=0, atol=tolerance)


def test_cma_es_judges_all_candidates_of_a_generation_on_the_same_instances(
    make_method: MakeMethod, monkeypatch: pytest.MonkeyPatch
) -> None:
    method: Any = make_method("cma_es", episodes_per_candidate=2)
    begun: list[Any] = []
    begin = Episodes.begin

    def remember(self: Episodes, slots: Any, instances: Any) -> None:
        begun.append(instances)
        begin(self, slots, instances)

    monkeypatch.setattr(Episodes, "begin", remember)
    method.train(BUDGET)
    (instances,) = begun
    by_candidate = instances.reshape(method.config.popsize, 2, -1)
    assert (by_candidate == by_candidate[0]).all()
    assert not np.array_equal(by_candidate[0, 0], by_candidate[0, 1])

"""The profile `paper`: exactly the hyperparameters in the appendix's tables, and 10 million steps.

The paper uses the same optimiser settings for its own method, the shared architecture and HWasP-minimal. A task that
the paper does not have gets the settings of its push.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from codesign_bench.config.profiles import Profile
from codesign_bench.config.settings import Settings, sourced
from codesign_bench.studies.corl2023.learners import (
    CMA_ES_SWEEP,
    CMA_RL,
    LEARNERS,
    SHARED_ARCH,
    LearnerTable,
    MlpBaselineTable,
)
from codesign_bench.studies.corl2023.protocol import PROTOCOL

BASELINE_TABLE = "paper, table of baseline hyperparameters"
TRANSFORM2ACT = "Transform2Act's default; the paper is silent"
TRANSFORM2ACT_TASKS = "Transform2Act's hopper and gap configurations; the paper is silent"


def optimizer(task_name: str) -> Settings:
    """Return the optimiser rows of the table of a task, and what the paper's text implies."""
    table = _table(task_name)
    rows = {
        "batch_size": table.batch_size,
        "minibatch_size": table.minibatch_size,
        "epochs": table.epochs,
        "policy_learning_rate": table.policy_learning_rate,
        "value_learning_rate": table.value_learning_rate,
        "entropy_weight": table.entropy_weight,
        "kl_threshold": table.kl_threshold,
        "control_log_std": table.control_log_std,
        "design_log_std": table.design_log_std,
        "fix_std": table.fix_std,
    }
    return {
        **sourced(rows, _source(task_name)),
        **sourced({"design_credit": "joint"}, "paper, section 'Policy learning': both phases train jointly"),
        **sourced({"batch_design": True}, TRANSFORM2ACT_TASKS),
        **sourced({"normalize_returns": False, "final_learning_rate_fraction": 1.0}, TRANSFORM2ACT),
    }


def graph_networks(task_name: str) -> Settings:
    """Return the network rows of the table of a task."""
    table = _table(task_name)
    rows = {
        "control_gnn": table.control_gnn,
        "control_index_mlp": table.control_index_mlp,
        "design_gnn": table.design_gnn,
        "design_index_mlp": table.design_index_mlp,
    }
    return {**sourced(rows, _source(task_name)), **sourced({"value_mlp": (512, 256)}, TRANSFORM2ACT)}


def perceptrons(table: MlpBaselineTable, task_name: str) -> Settings:
    """Return the rows of a baseline that learns perceptrons by PPO."""
    rows = {
        "policy_net": table.policy_net,
        "value_net": table.value_net,
        "policy_learning_rate": table.learning_rate,
        "value_learning_rate": table.learning_rate,
        "batch_size": table.batch_size_for(task_name),
        "minibatch_size": table.minibatch_size,
    }
    return sourced(rows, BASELINE_TABLE)


def evolution(task_name: str) -> Settings:
    """Return the best settings of CMA-ES in the paper's sweep, the same for every task."""
    del task_name
    best = {
        "popsize": int(CMA_ES_SWEEP.population_size.best),
        "sigma0": CMA_ES_SWEEP.sigma0.best,
        "center_learning_rate": CMA_ES_SWEEP.center_learning_rate.best,
        "covariance_learning_rate": CMA_ES_SWEEP.covariance_learning_rate.best,
        "rank_mu_learning_rate": CMA_ES_SWEEP.rank_mu_learning_rate.best,
        "rank_one_learning_rate": CMA_ES_SWEEP.rank_one_learning_rate.best,
    }
    return sourced(best, f"{BASELINE_TABLE} (bold)")


PARTS: Mapping[str, tuple[Callable[[str], Settings], ...]] = {
    "gnn_ppo": (optimizer, graph_networks),
    "shared_arch": (optimizer, lambda task_name: perceptrons(SHARED_ARCH, task_name)),
    "cma_rl": (optimizer, lambda task_name: perceptrons(CMA_RL, task_name), evolution),
    "hwasp_minimal": (optimizer, graph_networks),
    "cma_es": (evolution,),
}
"""Parts of each method's settings; later parts override."""


def hyperparameters(method_name: str, task_name: str) -> Settings:
    """Return the paper's settings for a method on a task; none for methods that are not in the paper."""
    return {name: entry for part in PARTS.get(method_name, ()) for name, entry in part(task_name).items()}


def _table(task_name: str) -> LearnerTable:
    return LEARNERS.get(task_name, LEARNERS["push"])


def _source(task_name: str) -> str:
    return f"paper, table of {task_name}" if task_name in LEARNERS else "paper, table of push (no table for this task)"


PAPER = Profile(
    "paper",
    "the paper's hyperparameter tables and 10 million steps",
    {
        **sourced({"steps": PROTOCOL.total_steps}, "paper, learning curves"),
        **sourced({"evaluations": 100}, "ours"),
    },
    hyperparameters,
)

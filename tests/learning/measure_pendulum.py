"""Measure stable-baselines3's PPO and this project's on the pendulum, side by side: run this file, with that package.

It writes `tests/data/pendulum_stable_baselines3.json`. A minute or two a run; `python measure_pendulum.py 0 1 2` names
the seeds. Both are judged on the same start states, acting with the mean. Each learns twice: with plain observations,
as that package does by default, and with observations normalised by running statistics, as this project does by
default.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import stable_baselines3
import torch
from pendulum import BUDGET, ENVIRONMENT, ENVIRONMENTS, MAX_TORQUE, OURS, STABLE_BASELINES3, Pendulum, train
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.learning.networks import RunningNorm
from codesign_bench.method import Policy
from codesign_bench.task import Singles

RECORD = Path(__file__).resolve().parent.parent / "data" / "pendulum_stable_baselines3.json"


class Reference(Policy):
    """A trained policy of stable-baselines3 in this project's words."""

    def __init__(self, model: stable_baselines3.PPO, normalize: Callable[[Singles], Singles]) -> None:
        self.model, self.normalize = model, normalize

    def design(self, observation: Singles) -> Singles:
        """Return the design that has no effect."""
        return np.zeros((*observation.shape[:-1], 1), dtype=np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return the mean torque over the largest."""
        torque: Singles = self.model.predict(self.normalize(observation[..., :3]), deterministic=True)[0]
        return torque / MAX_TORQUE

    def tensors(self) -> Mapping[str, Any]:  # type: ignore[override]  # It is never saved.
        """Return nothing."""
        return {}


def train_reference(seed: int, normalize_observations: bool) -> float:
    """Train stable-baselines3's PPO; return its mean return over the task's evaluation instances."""
    torch.set_num_threads(1)
    environments: Any = make_vec_env(ENVIRONMENT, n_envs=ENVIRONMENTS, seed=seed)
    normalize: Callable[[Singles], Singles] = np.copy
    if normalize_observations:
        environments = VecNormalize(environments, norm_obs=True, norm_reward=False, clip_obs=RunningNorm.CLIP)
        normalize = environments.normalize_obs
    model = stable_baselines3.PPO("MlpPolicy", environments, seed=seed, device="cpu", **STABLE_BASELINES3)
    model.learn(BUDGET)
    return float(evaluate(Pendulum(), Reference(model, normalize)).returns.mean())


def measured(measure: Callable[[int, bool], float], seeds: list[int], normalize_observations: bool) -> dict[str, Any]:
    """Return the mean returns of all seeds, their mean and their deviation."""
    returns = [round(measure(seed, normalize_observations), 2) for seed in seeds]
    return {
        "returns": returns,
        "mean": round(float(np.mean(returns)), 2),
        "standard_deviation": round(float(np.std(returns, ddof=1)), 2) if len(returns) > 1 else None,
    }


def main(seeds: list[int]) -> None:
    """Measure both and write the record."""
    record = {
        "how": f"python tests/learning/measure_pendulum.py {' '.join(map(str, seeds))}",
        "environment": ENVIRONMENT,
        "env_steps": BUDGET,
        "evaluation": f"{Pendulum.num_evaluation_instances} fixed start states, acting with the mean",
        "seeds": seeds,
        "versions": {
            "gymnasium": gymnasium.__version__,
            "stable_baselines3": stable_baselines3.__version__,
            "torch": torch.__version__,
        },
        "settings": {"stable_baselines3": STABLE_BASELINES3, "ours": {key: str(value) for key, value in OURS.items()}},
        "stable_baselines3": measured(train_reference, seeds, normalize_observations=False),
        "ours": measured(train, seeds, normalize_observations=False),
        "with_running_normalization": {
            "stable_baselines3": measured(train_reference, seeds, normalize_observations=True),
            "ours": measured(train, seeds, normalize_observations=True),
        },
    }
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [0, 1, 2])

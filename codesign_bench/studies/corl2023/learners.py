"""The learners of the paper, as its appendix prints them: its own method task by task, and the baselines."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class LearnerTable:
    """What the tables of all six tasks say about the learner of the paper's own method."""

    control_gnn: tuple[int, int, int]
    """Widths of the control policy's graph convolutions."""
    control_index_mlp: tuple[int, int]
    """Widths of the control policy's per-node tanh layers."""
    design_gnn: tuple[int, int, int]
    """Widths of the design policy's graph convolutions."""
    design_index_mlp: tuple[int, int]
    """Widths of the design policy's per-node tanh layers."""
    control_log_std: float
    """Initial logarithm of the control action's standard deviation."""
    design_log_std: float
    """Initial logarithm of the design action's standard deviation."""
    fix_std: bool
    """Whether both standard deviations are fixed."""
    policy_learning_rate: float
    """Adam's step size for both policies."""
    entropy_weight: float
    """Weight (beta) of the entropy bonus."""
    value_learning_rate: float
    """Adam's step size for the value net."""
    kl_threshold: float
    """KL divergence between old and new policy at which the epochs of a batch end."""
    batch_size: int
    """Environment steps collected per batch."""
    minibatch_size: int
    """Environment steps per gradient step."""
    epochs: int
    """Passes over each batch ("PPO Steps Per Batch")."""


@dataclass(frozen=True)
class Swept:
    """One hyperparameter of a sweep: the values tested and the best one (bold in the table)."""

    tested: tuple[float, ...]
    best: float


@dataclass(frozen=True, kw_only=True)
class CmaEsSweep:
    """The sweep over the CMA-ES baseline; CMA-RL's outer loop takes the best values, too."""

    population_size: Swept
    """Candidates per generation (pycma: popsize)."""
    sigma0: Swept
    """Initial standard deviation."""
    center_learning_rate: Swept
    """pycma: CMA_cmean."""
    covariance_learning_rate: Swept
    """pycma: CMA_on, a multiplier."""
    rank_mu_learning_rate: Swept
    """pycma: CMA_rankmu, a multiplier."""
    rank_one_learning_rate: Swept
    """pycma: CMA_rankone, a multiplier."""


@dataclass(frozen=True, kw_only=True)
class MlpBaselineTable:
    """A baseline that learns multi-layer perceptrons with PPO."""

    policy_net: tuple[int, ...]
    """Widths of the policy's hidden layers."""
    value_net: tuple[int, ...]
    """Widths of the value net's hidden layers."""
    learning_rate: float
    """Step size of the policy and value nets."""
    batch_size: int
    """Environment steps per batch, on every task but scoop 3D."""
    batch_size_scoop_3d: int
    """Environment steps per batch on scoop 3D."""
    minibatch_size: int
    """Environment steps per gradient step."""

    def batch_size_for(self, task_name: str) -> int:
        """Return the environment steps per batch on the task `task_name`."""
        return self.batch_size_scoop_3d if task_name == "scoop_3d" else self.batch_size


LEARNERS: dict[str, LearnerTable] = {
    # table:our_pushing
    "push": LearnerTable(
        control_gnn=(64, 64, 64),
        control_index_mlp=(128, 128),
        design_gnn=(64, 64, 64),
        design_index_mlp=(128, 128),
        control_log_std=-1.0,
        design_log_std=-2.3,
        fix_std=True,
        policy_learning_rate=2e-5,
        entropy_weight=0.01,
        value_learning_rate=1e-4,
        kl_threshold=0.005,
        batch_size=50000,
        minibatch_size=2000,
        epochs=10,
    ),
    # table:our_catching
    "catch_balls": LearnerTable(
        control_gnn=(64, 64, 64),
        control_index_mlp=(128, 128),
        design_gnn=(64, 64, 64),
        design_index_mlp=(128, 128),
        control_log_std=0.0,
        design_log_std=0.0,
        fix_std=True,
        policy_learning_rate=2e-5,
        entropy_weight=0.01,
        value_learning_rate=1e-4,
        kl_threshold=0.002,
        batch_size=50000,
        minibatch_size=2000,
        epochs=10,
    ),
    # table:our_scooping
    "scoop": LearnerTable(
        control_gnn=(64, 64, 64),
        control_index_mlp=(128, 128),
        design_gnn=(64, 64, 64),
        design_index_mlp=(128, 128),
        control_log_std=0.0,
        design_log_std=0.0,
        fix_std=True,
        policy_learning_rate=2e-5,
        entropy_weight=0.01,
        value_learning_rate=3e-4,
        kl_threshold=0.1,
        batch_size=50000,
        minibatch_size=2000,
        epochs=10,
    ),
    # table:our_fetch_cube
    "fetch_cube": LearnerTable(
        control_gnn=(128, 128, 128),
        control_index_mlp=(128, 128),
        design_gnn=(128, 128, 128),
        design_index_mlp=(128, 128),
        control_log_std=0.0,
        design_log_std=0.0,
        fix_std=False,
        policy_learning_rate=1e-4,
        entropy_weight=0.0,
        value_learning_rate=3e-4,
        kl_threshold=0.5,
        batch_size=50000,
        minibatch_size=2000,
        epochs=10,
    ),
    # table:our_lift_cup
    "lift_cup": LearnerTable(
        control_gnn=(128, 128, 128),
        control_index_mlp=(128, 128),
        design_gnn=(128, 128, 128),
        design_index_mlp=(128, 128),
        control_log_std=0.0,
        design_log_std=-1.0,
        fix_std=True,
        policy_learning_rate=2e-5,
        entropy_weight=0.01,
        value_learning_rate=3e-4,
        kl_threshold=0.5,
        batch_size=50000,
        minibatch_size=2000,
        epochs=5,
    ),
    # table:our_3d_scoop
    "scoop_3d": LearnerTable(
        control_gnn=(128, 128, 128),
        control_index_mlp=(128, 128),
        design_gnn=(128, 128, 128),
        design_index_mlp=(128, 128),
        control_log_std=0.0,
        design_log_std=0.0,
        fix_std=False,
        policy_learning_rate=1e-4,
        entropy_weight=0.01,
        value_learning_rate=3e-4,
        kl_threshold=0.5,
        batch_size=20000,
        minibatch_size=2000,
        epochs=5,
    ),
}


# table:baseline_hp, rows of CMA-ES
CMA_ES_SWEEP = CmaEsSweep(
    population_size=Swept((10, 24, 100, 1000), best=24),
    sigma0=Swept((0.1, 1.0, 10.0), best=0.1),
    center_learning_rate=Swept((0.01, 0.1, 1.0), best=1.0),
    covariance_learning_rate=Swept((0.01, 0.1, 1.0), best=1.0),
    rank_mu_learning_rate=Swept((0.01, 0.1, 1.0), best=1.0),
    rank_one_learning_rate=Swept((0.01, 0.1, 1.0), best=1.0),
)


# table:baseline_hp, rows of CMA-RL
CMA_RL = MlpBaselineTable(
    policy_net=(256, 256, 256, 256, 256),
    value_net=(256, 256, 256, 256, 256),
    learning_rate=3e-4,
    batch_size=50000,
    batch_size_scoop_3d=20000,
    minibatch_size=2000,
)


# table:baseline_hp, rows of Ours(shared arch.)
SHARED_ARCH = MlpBaselineTable(
    policy_net=(256, 256, 256, 256, 256),
    value_net=(256, 256, 256, 256, 256),
    learning_rate=1e-4,
    batch_size=50000,
    batch_size_scoop_3d=20000,
    minibatch_size=2000,
)

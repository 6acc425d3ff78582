"""Hyperparameters of the PPO-based methods: of PPO, of graph networks and of multilayer perceptrons."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from codesign_bench.config.search import Choice, Integer, LogUniform, Uniform
from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Length, Share, Within

Credit: TypeAlias = Literal["joint", "separate"]
Precision: TypeAlias = Literal["fp32", "bf16"]
BatchSteps: TypeAlias = Annotated[int, Within(1, 10_000_000)]
Passes: TypeAlias = Annotated[int, Within(1, 10_000)]
LearningRate: TypeAlias = Annotated[float, Within(0.0, 10.0)]
Divergence: TypeAlias = Annotated[float, Within(0.0, 1e9)]
LogStd: TypeAlias = Annotated[float, Within(-20.0, 5.0)]
Width: TypeAlias = Annotated[int, Within(1, 8_192)]
Widths: TypeAlias = Annotated[tuple[Width, ...], Length(0, 64)]
SomeWidths: TypeAlias = Annotated[tuple[Width, ...], Length(1, 64)]

TRANSFORM2ACT = {"source": "Transform2Act's default; the paper is silent"}
OURS = {"source": "ours"}
SEPARATE = ("design_credit", "separate")
"""Condition under which the designer has an update of its own."""


@dataclass(frozen=True, kw_only=True)
class PPOConfig:
    """Hyperparameters of every PPO-based method. All have defaults, and any task runs with the defaults."""

    batch_size: BatchSteps = field(default=10_000, metadata={"search": Integer(5_000, 40_000, log=True)})
    """Environment steps per batch; episodes are finished."""
    minibatch_size: BatchSteps = field(default=500, metadata={"search": Integer(250, 2_000, log=True)})
    """Environment steps per minibatch."""
    epochs: Passes = field(default=4, metadata={"search": Integer(2, 10)})
    """Passes over a batch (the paper's "PPO steps per batch")."""
    policy_learning_rate: LearningRate = field(default=7e-4, metadata={"search": LogUniform(3e-5, 3e-3)})
    """Adam's learning rate for designer and controller."""
    value_learning_rate: LearningRate = field(default=7e-4, metadata={"search": LogUniform(3e-5, 3e-3)})
    """Adam's learning rate for the value networks."""
    final_learning_rate_fraction: Share = field(default=1.0, metadata=OURS)
    """Learning rates decrease linearly over the budget to this fraction of their initial values."""
    entropy_weight: Annotated[float, Within(0.0, 1_000.0)] = 0.0
    """Weight of the entropy bonus; no effect with fixed standard deviations."""
    kl_threshold: Divergence = field(default=0.05, metadata={"search": LogUniform(0.01, 0.3)})
    """A batch's policy update stops at this estimated KL divergence."""
    control_log_std: LogStd = field(default=-0.5, metadata={"search": Uniform(-2.0, 0.0)})
    """(Initial) log standard deviation of controls in [-1, 1]."""
    design_log_std: LogStd = field(default=-1.0, metadata={"search": Uniform(-2.0, 0.0)})
    """(Initial) log standard deviation of designs in [-1, 1]."""
    fix_std: bool = True
    """Whether the standard deviations are fixed instead of learned."""
    gamma: Share = field(
        default=0.995, metadata={**TRANSFORM2ACT, "search": Choice((0.95, 0.97, 0.98, 0.99, 0.995, 0.999))}
    )
    """Discount factor per step."""
    gae_lambda: Share = field(default=0.95, metadata={**TRANSFORM2ACT, "search": Uniform(0.9, 1.0)})
    """Lambda of generalised advantage estimation."""
    clip_ratio: Share = field(default=0.2, metadata={**TRANSFORM2ACT, "search": Uniform(0.1, 0.3)})
    """Clipping range of the probability ratio."""
    max_gradient_norm: Annotated[float, Within(0.0, 1e9)] = field(default=40.0, metadata=TRANSFORM2ACT)
    """Largest gradient norm; larger gradients are scaled down."""
    bootstrap_time_limit: bool = field(default=True, metadata=OURS)
    """Whether the value of the final state is bootstrapped at the time limit; False treats the limit as termination."""
    normalize_observations: bool = field(default=True, metadata={"source": "Transform2Act's; the paper is silent"})
    """Whether state and goal are normalised by their running mean and standard deviation; False: by their bounds."""
    normalize_returns: bool = field(default=True, metadata=OURS)
    """Whether the value network learns returns normalised by their running mean and standard deviation."""
    design_credit: Credit = "joint"
    """Credit of the design step: `joint` (the paper's) or `separate` (ours)."""
    batch_design: bool = field(default=False, metadata=OURS)
    """Under joint credit, whether an epoch's first minibatches hold all design steps; False spreads them over all."""
    design_learning_rate: LearningRate = field(
        default=7e-4, metadata={"search": LogUniform(1e-4, 3e-2, where=SEPARATE)}
    )
    """Adam's learning rate for the designer under separate credit."""
    design_epochs: Passes = field(default=10, metadata={**OURS, "search": Integer(2, 20, where=SEPARATE)})
    """Passes over a batch's design steps under separate credit."""
    design_minibatch_size: BatchSteps = field(default=1_000, metadata=OURS)
    """Design steps per minibatch under separate credit."""
    design_kl_threshold: Divergence = field(
        default=0.05, metadata={**OURS, "search": LogUniform(0.01, 1.0, where=SEPARATE)}
    )
    """Under separate credit, the design update stops at this estimated KL divergence."""
    precision: Precision = field(default="fp32", metadata=OURS)
    """`fp32`, or `bf16` for matrix products in updates: several times as fast on processors with bfloat16 units."""
    num_slots: Annotated[int, Within(1, 1_000_000)] | None = field(default=None, metadata=OURS)
    """Number of parallel episodes; None: as many as fill a batch with one full-length episode each."""

    def __post_init__(self) -> None:
        check_values(self)


@dataclass(frozen=True, kw_only=True)
class GraphConfig(PPOConfig):
    """Hyperparameters of a PPO-based method with graph networks."""

    control_gnn: SomeWidths = (64, 64, 64)
    """Widths of the controller's and the value network's graph convolutions."""
    control_index_mlp: Widths = (64, 64)
    """Widths of the controller's index MLP."""
    design_gnn: SomeWidths = (64, 64, 64)
    """Widths of the designer's graph convolutions."""
    design_index_mlp: Widths = (64, 64)
    """Widths of the designer's index MLP."""
    value_mlp: Widths = (128,)
    """Widths of the tanh layers after the value network's graph network."""


@dataclass(frozen=True, kw_only=True)
class PerceptronConfig(PPOConfig):
    """Hyperparameters of a PPO-based method with multilayer perceptrons."""

    policy_net: SomeWidths = (208, 208, 208)
    """Widths of the policy's hidden layers."""
    value_net: SomeWidths = (208, 208, 208)
    """Widths of the value network's hidden layers."""

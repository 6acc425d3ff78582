"""Every number that the paper's appendix prints, spelled once; the `paper` profile and the tasks read them here.

Source: "Learning to Design and Use Tools for Robotic Manipulation" (CoRL 2023). Beside each group stands the LaTeX
label of its table. Planar tasks measure in world units and degrees, three-dimensional ones in metres and degrees
(the paper prints no units; these are our reading). Names of tasks and methods are this project's.

Inconsistencies of the paper, kept as printed:

- The planar chain has two angles (section "Tool design space"), yet "Tool Angle Init." lists three entries; so do
  "Tool Angle Min" and "Tool Angle Max" for the three-link box chain, whose 11 parameters leave room for two.
- "Control Action Min/Max" of fetch cube and lift cup bound six numbers, where the text says that the control action
  space is R^3, a change in end-effector position. Scoop 3D has six in both places.
- The box dimensions of scoop 3D have the same smallest and largest second entry: that dimension is fixed.
- "Success Reward" is listed for the three-dimensional tasks only.
"""

from __future__ import annotations

from dataclasses import dataclass

Interval = tuple[float, float]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class SceneTable:
    """What the tables of all six tasks say about the scene."""

    tool_position_init: tuple[float, ...]
    """Where the tool's fixed point starts: (x, y) in world units, or (x, y, z) in m."""
    control_steps_per_action: int
    """Simulation steps for which one control action is held."""
    max_episode_steps: int
    """Control steps until the time limit."""
    slack_reward: float
    """Reward added in every step."""


@dataclass(frozen=True, kw_only=True)
class PlanarSceneTable(SceneTable):
    """Scene of a task with the planar three-link chain."""

    tool_length_ratio: Interval
    """Range of the relative change r of a link's length; we read: length = initial length * (1 + r)."""
    tool_length_init: Triple
    """Initial length of each link, in world units."""
    tool_angle_init: Triple
    """Initial relative angles, in degrees; three as printed, for two joints."""
    tool_angle_ratio: Interval
    """Range of the angle's factor r; we read: angle = initial angle + scale * r."""
    tool_angle_scale: float
    """Angle of r = 1, in degrees."""


@dataclass(frozen=True, kw_only=True)
class BoxSceneTable(SceneTable):
    """Scene of a task whose tool is made of boxes."""

    success_reward: float
    """Reward added once, on success."""
    box_dimensions_min: Triple
    """Smallest box dimensions, in m."""
    box_dimensions_max: Triple
    """Largest box dimensions, in m."""
    tool_angle_min: Triple
    """Smallest relative angles, in degrees; three as printed."""
    tool_angle_max: Triple
    """Largest relative angles, in degrees; three as printed."""
    control_action_min: tuple[float, ...]
    """Lower bounds of the control action before scaling: three for position, three for rotation."""
    control_action_max: tuple[float, ...]
    """Upper bounds of the control action before scaling."""
    control_action_scale: float
    """Factor from the control action to the change in end-effector pose."""


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
    """Whether both standard deviations stay as they start."""
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


@dataclass(frozen=True)
class Timing:
    """Time that one method took on fetch cube, on an NVIDIA Titan RTX and an Intel Xeon Gold 5220."""

    training_minutes: float
    """Wall clock for 10^7 environment steps."""
    inference_seconds: float | None
    """One forward pass; None where there is no model."""


@dataclass(frozen=True)
class Patch:
    """A rectangle of fetch cube's starts, in m."""

    x: Interval
    y: Interval


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """How the paper's experiments were run (captions and appendix "Experimental Details")."""

    total_steps: int
    """Environment steps of one training run; the paper says so of its timing table."""
    seeds: int
    """Seeds per method and task in the learning curves."""
    seeds_scoop_3d: int
    """The same on scoop 3D."""
    seeds_generalisation: int
    """Seeds of the cutout and fine-tuning experiments."""
    cutout_fractions: tuple[float, ...]
    """Fractions of the training area that were cut out."""
    fetch_cube_region: Patch
    """Fetch cube's training region."""
    fetch_cube_patches: tuple[Patch, Patch]
    """The two patches of its cutout region, which the fractions scale."""
    fine_tuning_starts: tuple[Interval, Interval, Interval, Interval]
    """Starts (x, y) outside the training region, in m."""
    alphas: tuple[float, ...]
    """Trade-off parameters trained on catch balls (equation 1)."""

    def seeds_for(self, task_name: str) -> int:
        """Return the number of seeds in the learning curves of the task `task_name`."""
        return self.seeds_scoop_3d if task_name == "scoop_3d" else self.seeds


@dataclass(frozen=True, kw_only=True)
class RealRobot:
    """The paper's evaluation on a real Franka Panda (section "Evaluation on a real robot" and its appendix).

    Fetch cube's places are in the robot's frame as printed: m, the base at the origin, y negative where the cubes lie.
    """

    fetch_cube_starts: tuple[Triple, ...]
    """Where the cube starts for which each tool was designed."""
    lift_cup_sizes: tuple[Interval, ...]
    """Scales of length and width, and of height, of the cup for which each tool was designed."""
    trials: int
    """With each tool on its own instance."""
    max_steps: int
    """Control steps until a trial ends without success."""
    grid_shape: tuple[int, int]
    """Rows and columns of the grid of starts on which every fetch-cube tool is tried."""
    grid_extent: Interval
    """Along the rows' and the columns' direction, m: every 6 cm and every 28.53 cm."""
    near_miss: float
    """A cube that ends so near to success counts as nearly fetched, m."""
    fetch_cube_distance: float
    """The cube is fetched when its centre is nearer to the base, m."""
    lift_cup_height: float
    """The cup is lifted when it is higher above the table, m."""
    own_successes: dict[str, tuple[int, ...]]
    """Trials that succeeded by tool, of `trials`."""
    grid_successes: tuple[int, ...]
    """Starts of the grid that succeeded by fetch-cube tool."""


PLANAR_SCENES: dict[str, PlanarSceneTable] = {
    # table:our_pushing
    "push": PlanarSceneTable(
        tool_position_init=(20, 10),
        control_steps_per_action=1,
        max_episode_steps=150,
        slack_reward=-0.001,
        tool_length_ratio=(-0.5, 0.5),
        tool_length_init=(2.0, 2.0, 2.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-1.0, 1.0),
        tool_angle_scale=90.0,
    ),
    # table:our_catching
    "catch_balls": PlanarSceneTable(
        tool_position_init=(20, 10),
        control_steps_per_action=1,
        max_episode_steps=150,
        slack_reward=-0.001,
        tool_length_ratio=(-0.5, 2.0),
        tool_length_init=(2.0, 1.0, 1.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-1.0, 1.0),
        tool_angle_scale=60.0,
    ),
    # table:our_scooping
    "scoop": PlanarSceneTable(
        tool_position_init=(15, 10),
        control_steps_per_action=5,
        max_episode_steps=30,
        slack_reward=-0.001,
        tool_length_ratio=(-0.7, 0.2),
        tool_length_init=(6.0, 3.0, 3.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-0.1, 0.7),
        tool_angle_scale=90.0,
    ),
}

BOX_SCENES: dict[str, BoxSceneTable] = {
    # table:our_fetch_cube
    "fetch_cube": BoxSceneTable(
        tool_position_init=(0.0, 0.5, 0.02),
        control_steps_per_action=10,
        max_episode_steps=100,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.005, 0.05, 0.005),
        box_dimensions_max=(0.015, 0.1, 0.02),
        tool_angle_min=(-90.0, -90.0, -90.0),
        tool_angle_max=(90.0, 90.0, 90.0),
        control_action_min=(-1.0, -1.0, -1.0, -0.2, -0.2, -0.2),
        control_action_max=(1.0, 1.0, 1.0, 0.2, 0.2, 0.2),
        control_action_scale=0.1,
    ),
    # table:our_lift_cup
    "lift_cup": BoxSceneTable(
        tool_position_init=(0.0, 1.2, 0.05),
        control_steps_per_action=10,
        max_episode_steps=150,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.005, 0.02, 0.01),
        box_dimensions_max=(0.01, 0.1, 0.03),
        tool_angle_min=(-30.0, -30.0, -30.0),
        tool_angle_max=(30.0, 30.0, 30.0),
        control_action_min=(-1.0, -1.0, -1.0, -1.57, -1.57, -1.57),
        control_action_max=(1.0, 1.0, 1.0, 1.57, 1.57, 1.57),
        control_action_scale=0.1,
    ),
    # table:our_3d_scoop
    "scoop_3d": BoxSceneTable(
        tool_position_init=(0.0, 0.05, 0.1),
        control_steps_per_action=10,
        max_episode_steps=100,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.04, 0.005, 0.02),
        box_dimensions_max=(0.08, 0.005, 0.05),
        tool_angle_min=(-15.0, -15.0, -15.0),
        tool_angle_max=(15.0, 15.0, 15.0),
        control_action_min=(-1.0, -1.0, -1.0, -1.57, -1.57, -1.57),
        control_action_max=(1.0, 1.0, 1.0, 1.57, 1.57, 1.57),
        control_action_scale=0.05,
    ),
}

SCENES: dict[str, SceneTable] = {**PLANAR_SCENES, **BOX_SCENES}

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

# The unlabelled table of section "Computational Resources"
TIMINGS: dict[str, Timing] = {
    "gnn_ppo": Timing(2.12e2, 1.68e-3),
    "shared_arch": Timing(7.29e2, 5.24e-4),
    "cma_rl": Timing(1.18e3, 5.32e-4),
    "hwasp_minimal": Timing(2.98e2, 1.75e-3),
    "cma_es": Timing(3.46e2, None),
}

# Captions of fig:sample_efficiency and fig:interpolation; sections "Computational Resources", "Generalization to
# Unseen Goals Experiment Details" and "Trading off Design and Control Complexity Experiment Details"
PROTOCOL = Protocol(
    total_steps=10_000_000,
    seeds=6,
    seeds_scoop_3d=3,
    seeds_generalisation=3,
    cutout_fractions=(0.1, 0.2, 0.4, 0.6, 0.8, 0.9),
    fetch_cube_region=Patch(x=(-0.395, 0.395), y=(0.4, 0.7)),
    fetch_cube_patches=(
        Patch(x=(-0.350, -0.045), y=(0.434, 0.666)),
        Patch(x=(0.045, 0.350), y=(0.434, 0.666)),
    ),
    fine_tuning_starts=((-0.167, 0.367), (-0.129, 0.357), (0.430, 0.493), (0.415, 0.610)),
    alphas=(0.0, 0.3, 0.7, 1.0),
)

# tab:real_exp, tab:real_fetchcube, tab:real_liftcup, fig:detailed_other_inits_results and the text around them
REAL_ROBOT = RealRobot(
    fetch_cube_starts=(
        (-0.110, -0.803, 0.025),
        (-0.339, -0.588, 0.025),
        (0.155, -0.731, 0.025),
        (0.211, -0.633, 0.025),
    ),
    lift_cup_sizes=((0.3, 0.6), (0.3, 0.9), (0.5, 0.8), (0.9, 0.6)),
    trials=5,
    max_steps=100,
    grid_shape=(3, 4),
    grid_extent=(0.12, 0.856),
    near_miss=0.05,
    fetch_cube_distance=0.5,
    lift_cup_height=0.4,
    own_successes={"fetch_cube": (5, 5, 5, 5), "lift_cup": (5, 5, 5, 5)},
    grid_successes=(10, 4, 6, 5),
)

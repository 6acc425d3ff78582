"""What a task is, and what it is made of; everything that a new task needs is imported from here.

`spaces.py` names and bounds, `tool.py` what tools are made of, `simulator.py` the physics, `behaviour.py` what acts,
`task.py` the task itself, `loading.py` tasks by name, `episodes.py` the two-phase episode, `envs.py` Gymnasium's view
of it, `robot.py` what deployment on an arm asks of a task.
"""

from codesign_bench.task.behaviour import Behaviour
from codesign_bench.task.loading import deployable_tasks, deployment_of, load_task, task_names
from codesign_bench.task.scene import OURS, Constant, Given, constants
from codesign_bench.task.simulator import Physics, Simulator, Soundness
from codesign_bench.task.spaces import Booleans, Box, Floats, Frame, Layout, Observed, Quantity, Singles, Slots, Span
from codesign_bench.task.task import EVALUATION_SEED, ByProfile, Task
from codesign_bench.task.tool import BoxPart, PlanarPart, ToolGraph, ToolPart

__all__ = [
    "EVALUATION_SEED",
    "OURS",
    "Behaviour",
    "Booleans",
    "Box",
    "BoxPart",
    "ByProfile",
    "Constant",
    "Floats",
    "Frame",
    "Given",
    "Layout",
    "Observed",
    "Physics",
    "PlanarPart",
    "Quantity",
    "Simulator",
    "Singles",
    "Slots",
    "Soundness",
    "Span",
    "Task",
    "ToolGraph",
    "ToolPart",
    "constants",
    "deployable_tasks",
    "deployment_of",
    "load_task",
    "task_names",
]

"""The interface of a task; a new task imports everything it needs from here.

`spaces.py` has names and bounds, `tool.py` the shapes of tools, `simulator.py` the physics, `behaviour.py` designers
and controllers, `task.py` the task itself, `loading.py` tasks by name, `episodes.py` the two-phase episode, `envs.py`
Gymnasium environments, `robot.py` what a task must define to be deployed on an arm.
"""

from codesign_bench.task.behaviour import Behaviour
from codesign_bench.task.loading import deployable_tasks, deployment_of, load_task, task_names, usable_tasks
from codesign_bench.task.scene import OURS, Constant, Given, constants
from codesign_bench.task.simulator import Physics, Simulator, Soundness
from codesign_bench.task.sketch import Item, Numbers, Shape, Sketch, Viewpoint, Window
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
    "Item",
    "Layout",
    "Numbers",
    "Observed",
    "Physics",
    "PlanarPart",
    "Quantity",
    "Shape",
    "Simulator",
    "Singles",
    "Sketch",
    "Slots",
    "Soundness",
    "Span",
    "Task",
    "ToolGraph",
    "ToolPart",
    "Viewpoint",
    "Window",
    "constants",
    "deployable_tasks",
    "deployment_of",
    "load_task",
    "task_names",
    "usable_tasks",
]

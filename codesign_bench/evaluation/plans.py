"""Plans of episodes: recorded from any behaviour, and played again without it.

Simulators are deterministic, so a plan is all that it takes to repeat what a policy, a script or a search once did.

Shapes: `N` plans, `X` numbers of a plan, `I` instance.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from codesign_bench.evaluation.evaluate import Evaluation, evaluate
from codesign_bench.task import Behaviour, Floats, Singles, Task
from codesign_bench.task.episodes import Episodes, portions
from codesign_bench.task.plans import controls_of, designs_of
from codesign_bench.task.simulators import Simulators
from codesign_bench.task.spaces import Slots


class _Repeated(Behaviour):
    """Designs that are given, and controls that it is shown in the place of observations."""

    def __init__(self, designs: Singles) -> None:
        self.designs = designs

    def design(self, observation: Singles) -> Singles:
        """Return the given designs."""
        return self.designs

    def act(self, observation: Singles) -> Singles:
        """Return what is shown."""
        return observation


def plans_of(evaluation: Evaluation) -> Singles:
    """Return the plans (N, X) of episodes that were played, in single precision, as policies act."""
    controls = evaluation.controls.astype(np.float32).reshape(len(evaluation.controls), -1)
    return np.concatenate([evaluation.unit_designs, controls], axis=1)


def replay(task: Task, plans: Singles, instances: Floats, simulators: Simulators | None = None) -> Evaluation:
    """Play plans (N, X) on one instance (N, I) each.

    Args:
        task: what is played.
        plans: numbers outside of [-1, 1] act like the bounds.
        instances: in the instance space's units.
        simulators: lends the simulator; None: a new one.
    """
    lender = Simulators(task) if simulators is None else simulators
    parts = []
    for part in portions(len(plans), task):
        designs, controls = designs_of(task, plans[part]), controls_of(task, plans[part])

        def control_of(episodes: Episodes, slots: Slots, controls: Singles = controls) -> Singles:
            return controls[slots, episodes.elapsed[slots]]

        parts.append(evaluate(task, _Repeated(designs), None, instances[part], lender, control_of))
    return Evaluation(
        **{field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Evaluation)}
    )

"""What is promised of every task and every method, as checks that say in plain words what is wrong.

`check.py` has what a check is, `task_*.py` the checks of a task, `method_*.py` those of a method, `tasks.py` and
`methods.py` all of them in order. The command `check` and the tests of every member ask the same checks.
"""

from codesign_bench.contract.check import Check, DoesWithoutError, Fault, Verdict, ask, examine, promised
from codesign_bench.contract.methods import METHOD_CHECKS, examine_method
from codesign_bench.contract.subject import Subject
from codesign_bench.contract.tasks import TASK_CHECKS, examine_task

__all__ = [
    "METHOD_CHECKS",
    "TASK_CHECKS",
    "Check",
    "DoesWithoutError",
    "Fault",
    "Subject",
    "Verdict",
    "ask",
    "examine",
    "examine_method",
    "examine_task",
    "promised",
]

"""The interface of a method; a new method imports everything it needs from here.

`problem.py` defines what a method learns, `method.py` the method itself, `loading.py` methods by name.
"""

from codesign_bench.method.loading import load_method, method_names, usable_methods
from codesign_bench.method.method import Array, BatchReport, Method, Policy, State
from codesign_bench.method.problem import Problem

__all__ = [
    "Array",
    "BatchReport",
    "Method",
    "Policy",
    "Problem",
    "State",
    "load_method",
    "method_names",
    "usable_methods",
]

"""A method takes over a trained policy, or says that it cannot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.method import Method, Problem, load_method, method_names
from codesign_bench.seeding import Streams
from codesign_bench.task import Task


@pytest.mark.parametrize("name", method_names())
def test_a_method_takes_over_a_policy_or_says_that_it_cannot(name: str, push: Task) -> None:
    method_class = load_method(name)
    config: Any = method_class.config_class()
    donor, heir = (method_class(Problem(push), config, Streams(seed)) for seed in (0, 1))
    if method_class.start_from is Method.start_from:
        with pytest.raises(UserError, match=f"method '{name}' cannot start from a trained policy"):
            heir.start_from(donor.policy().tensors())
        return
    heir.start_from(donor.policy().tensors())
    for key, array in donor.policy().tensors().items():
        np.testing.assert_array_equal(heir.policy().tensors()[key], array, err_msg=key)

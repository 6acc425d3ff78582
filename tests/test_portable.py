"""The settings of `make test-portable` are in force: otherwise it would test the same numbers twice."""

from __future__ import annotations

import os
import platform

import numpy as np
import pytest
import torch

TOLD = os.environ.get("ATEN_CPU_CAPABILITY"), os.environ.get("NPY_DISABLE_CPU_FEATURES")

pytestmark = [
    pytest.mark.numeric,
    pytest.mark.skipif(None in TOLD, reason="not started by make test-portable"),
    pytest.mark.skipif(platform.machine() != "x86_64", reason="the settings are those of x86 processors"),
]


def test_torch_takes_the_instructions_that_it_is_told() -> None:
    assert torch.backends.cpu.get_cpu_capability().lower() == TOLD[0]


def test_numpy_leaves_out_the_instructions_that_it_is_told() -> None:
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    assert set(str(TOLD[1]).split(",")).isdisjoint(found)

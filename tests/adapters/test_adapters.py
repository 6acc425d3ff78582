"""The package of adapters imports no library, and says in one line which one is missing."""

from __future__ import annotations

import subprocess
import sys

import pytest

from codesign_bench import adapters


@pytest.mark.parametrize(
    ("name", "extra", "library"),
    [
        ("SB3VecEnv", "sb3", "stable_baselines3"),
        ("TorchRLEnv", "torchrl", "torch"),
    ],
)
def test_a_missing_library_is_named_with_its_extra(name: str, extra: str, library: str) -> None:
    code = (
        f"import sys; sys.modules[{library!r}] = None; import codesign_bench.adapters; codesign_bench.adapters.{name}"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    message = f"{name} needs {library}, which is not installed: pip install 'codesign-bench[{extra}]'"
    assert done.stderr.splitlines()[-1] == f"codesign_bench.errors.UnavailableError: {message}"


def test_importing_the_package_imports_no_library() -> None:
    code = (
        "import sys, codesign_bench.adapters as adapters; dir(adapters);"
        "print(sorted({'torch', 'torchrl', 'stable_baselines3'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_it_has_no_other_names() -> None:
    assert dir(adapters) == ["SB3VecEnv", "TorchRLEnv"]
    with pytest.raises(AttributeError, match="no attribute 'RLlibEnv'"):
        adapters.RLlibEnv  # noqa: B018

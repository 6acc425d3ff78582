"""`codesign-bench list` names everything and imports nothing that takes long."""

from __future__ import annotations

import subprocess
import sys

import pytest

from codesign_bench import method_names, task_names
from codesign_bench.cli import main
from codesign_bench.method import load_method
from codesign_bench.registry import built_in, names

pytestmark = pytest.mark.usefixtures("toy")


def test_list_names_everything_and_imports_nothing_heavy() -> None:
    program = (
        "import sys; from codesign_bench.cli import main; code = main(['list']); "
        "heavy = [name for name in sys.modules if name.split('.')[0] in ('torch', 'pybullet', 'pymunk', 'cma')"
        " or name.startswith(('codesign_bench.methods.', 'codesign_bench.tasks.', 'codesign_bench.paper_figs.'))]; "
        "sys.exit(f'imported {heavy}' if heavy else code)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    listed = [line.split()[0] for line in done.stdout.splitlines()]
    assert {*method_names(), *task_names(), *names("paper_figs"), "quick", "laptop", "paper"} <= set(listed)


@pytest.mark.parametrize("name", built_in("methods"))
def test_it_says_of_each_built_in_method_whether_it_makes_a_tool_per_goal(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list"]) == 0
    words = {line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines()}
    expected = "a tool per goal" if load_method(name).tool_per_goal else "one tool for all goals"
    assert " ".join(words[name]) == expected

"""`codesign-bench list` names everything and imports nothing that takes long."""

from __future__ import annotations

import subprocess
import sys

import pytest

from codesign_bench import method_names, task_names
from codesign_bench.registry import names

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

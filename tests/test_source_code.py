"""A member's own code: which modules it is made of, and what of their source can change a number."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import write_files
from codesign_bench.source_code import SourceModule, essence, own_modules

CODE = b'''"""What it is for."""
# A comment.
SPEED = 2.0  # m/s
"""Of the puck."""


class Puck:
    """A puck."""

    def mass(self) -> float:
        """Return its mass."""
        return 1.5  # kg
'''


def names(module: str) -> set[str]:
    """Return the names of a module's own modules."""
    return {one.name for one in own_modules(module)}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"# A comment.", b'# Another comment, with \xc3\xa4 and "quotes".'),
        (b"  # m/s", b""),
        (b'"""What it is for."""', b'"""What it was for,\n\nonce.\n"""'),
        (b'"""Of the puck."""', b""),
        (b'"""Return its mass."""', b'r"""Return the mass; \\mu."""'),
        (b"\n\n\nclass", b"\n\n\n\n\nclass"),
        (b"\n", b"\r\n"),
    ],
)
def test_comments_docstrings_and_blank_lines_are_not_essential(old: bytes, new: bytes) -> None:
    changed = CODE.replace(old, new)
    assert changed != CODE
    assert essence(changed) == essence(CODE)


@pytest.mark.parametrize(
    ("old", "new"),
    [(b"2.0", b"2.5"), (b"return 1.5", b"pass"), (b"Puck", b"Disc"), (b"SPEED", b'NOTE = "# no comment"\nSPEED')],
)
def test_everything_else_is(old: bytes, new: bytes) -> None:
    assert essence(CODE.replace(old, new)) != essence(CODE)


def test_a_text_that_is_a_value_is_essential() -> None:
    assert essence(b'NAME = "a # b"\n') != essence(b'NAME = "a # c"\n')
    assert essence(b'def name():\n    return """a"""\n') != essence(b'def name():\n    return """b"""\n')


@pytest.mark.parametrize("content", [b"\x7fELF\x00\x01", b"def broken(:\n", b"\xff\xfe"])
def test_what_is_no_python_source_counts_as_it_is(content: bytes) -> None:
    assert essence(content) == content


def test_a_member_is_its_module_and_what_this_imports_from_its_package(modules: Path) -> None:
    write_files(
        modules,
        {
            "sticks/__init__.py": "from .other import Other\nfrom .shapes import Shape\n",
            "sticks/reach.py": "from . import physics\nfrom .numbers import MASS\nfrom sticks import Shape\n",
            "sticks/numbers.py": "MASS = 1.0\n",
            "sticks/physics.py": "def step():\n    from .engine.solver import solve\n    return solve()\n",
            "sticks/engine/__init__.py": "",
            "sticks/engine/solver.py": "def solve(): ...\n",
            "sticks/shapes.py": "class Shape: ...\n",
            "sticks/other.py": "from .alone import ALONE\nclass Other: ...\n",
            "sticks/alone.py": "ALONE = 1\n",
        },
    )
    own = ("reach", "numbers", "physics", "engine.solver", "shapes")
    assert names("sticks.reach") == {f"sticks.{name}" for name in own}
    assert names("sticks.other") == {"sticks.other", "sticks.alone"}


def test_what_a_package_itself_defines_is_part_of_it(modules: Path) -> None:
    write_files(modules, {"sticks/__init__.py": "MASS = 1.0\n", "sticks/reach.py": "from . import MASS\n"})
    assert names("sticks.reach") == {"sticks.reach", "sticks"}


def test_imports_for_type_checkers_and_scripts_do_not_count(modules: Path) -> None:
    text = "if TYPE_CHECKING:\n    from .types import T\nclass R:\n    def script(self):\n        from .hand import H\n"
    write_files(
        modules, {"sticks/__init__.py": "", "sticks/reach.py": text, "sticks/types.py": "", "sticks/hand.py": ""}
    )
    assert names("sticks.reach") == {"sticks.reach"}


def test_imports_in_a_circle_end(modules: Path) -> None:
    write_files(modules, {"one.py": "import two\n", "two.py": "import one\n"})
    assert names("one") == {"one", "two"}


def test_a_single_file_has_what_lies_beside_it(modules: Path) -> None:
    write_files(
        modules,
        {
            "reach.py": "import numpy\nimport helper\nfrom beside.deep import DEEP\nimport missing_package\n",
            "helper.py": "",
            "beside/__init__.py": "",
            "beside/deep.py": "DEEP = 1\n",
            "unused.py": "",
        },
    )
    assert names("reach") == {"reach", "helper", "beside.deep"}


def test_a_module_of_a_namespace_package_is_found(modules: Path) -> None:
    write_files(modules, {"space/sticks/reach.py": "from . import numbers\n", "space/sticks/numbers.py": ""})
    assert names("space.sticks.reach") == {"space.sticks.reach", "space.sticks.numbers"}


def test_a_built_in_member_has_the_shared_files_and_nothing_of_the_core() -> None:
    assert names("codesign_bench.tasks.push") == {
        f"codesign_bench.tasks.{name}" for name in ("push", "_planar", "_scene")
    }
    assert names("codesign_bench.methods.cma_es") == {
        f"codesign_bench.methods.{name}" for name in ("cma_es", "_open_loop", "_settings")
    }


def test_a_foreign_member_has_the_shared_files_that_it_uses(modules: Path) -> None:
    write_files(
        modules, {"reach.py": "from codesign_bench.tasks._scene import COLOURS\nfrom codesign_bench.task import Task\n"}
    )
    assert names("reach") == {"reach", "codesign_bench.tasks._scene"}


def test_what_was_defined_nowhere_has_no_code() -> None:
    assert own_modules("no_such_module") == []


def test_a_literal_that_a_class_states_is_read_without_an_import(modules: Path) -> None:
    (modules / "stating.py").write_text(
        "raise ImportError\nother = 1\nclass A:\n    other: bool = 1\n    wanted = name = False\n    made = bool()\n"
    )
    module = SourceModule("stating")
    assert [module.stated(name) for name in ("wanted", "name", "made", "other")] == [False, False, None, None]
    (modules / "extending.py").write_text("from stating import A\nclass B(A[int]):\n    name = 'b'\n")
    assert [SourceModule("extending").stated(name) for name in ("wanted", "name", "made")] == [False, "b", None]
    assert SourceModule("not_there").stated("wanted") is None

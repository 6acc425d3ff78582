"""What has to be settled before anything else is imported: where modules come from, standard streams, and Ctrl-C.

The package calls `prepare` before its first import. It does most of its work only where the package is a program and
not a library of somebody's script.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterable
from importlib.machinery import ModuleSpec, PathFinder
from typing import Any

PROGRAM = "codesign-bench"
PACKAGE = "codesign_bench"
IMPORTS_VARIABLE = "CODESIGN_BENCH_IMPORTS"
"""Environment variable through which `--import` reaches other processes: `module,module`, and `=folder` if needed."""
SAFE_PATH_VARIABLE = "PYTHONSAFEPATH"
"""Environment variable that keeps the working folder off the module path, since Python 3.11."""
EXIT_INTERRUPTED = 130


def prepare() -> None:
    """Settle what is described above; does nothing to a script that imports the package, unless `--import` started it.

    A process that another one with `--import` has started finds the imported modules, wherever they are.
    """
    if is_program():
        keep_working_folder_off_path()
        open_standard_streams()
        end_quietly_on_interrupt()
    modules, folder = imports_of(os.environ.get(IMPORTS_VARIABLE, ""))
    if folder:
        search_folder(folder, modules)


def is_program() -> bool:
    """Return whether this process was started as `codesign-bench` or `python -m codesign_bench`."""
    name = os.path.basename(sys.argv[0] if sys.argv else "")
    return name.removesuffix(".exe") == PROGRAM or _module_of_command() == PACKAGE


def _module_of_command() -> str:
    """Return the package that `python -m` runs, or nothing."""
    for option, value in zip(sys.orig_argv[1:], [*sys.orig_argv[2:], ""], strict=True):
        if option.startswith("-m"):
            return (option[2:] or value).partition(".")[0]
        if not option.startswith("-"):  # the first word that is no option is a script
            return ""
    return ""


def keep_working_folder_off_path() -> None:
    """Undo what `python -m` does to the module path, so that a user's own `random.py` beside the results never runs."""
    if _module_of_command() and not (getattr(sys.flags, "safe_path", False) or sys.flags.isolated):
        try:
            folder = os.getcwd()
        except OSError:  # the working folder was deleted, and Python has not put it on the path
            return
        if sys.path[:1] in ([folder], [""]):
            del sys.path[0]


def open_standard_streams() -> None:
    """Connect standard streams that are closed to nothing.

    Otherwise the next file that is opened gets the number of a standard stream, and whatever a library prints is
    written into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # takes the lowest free number, which is this one
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # as long as the process lives


def end_quietly_on_interrupt() -> None:
    """Make Ctrl-C end this process at once, with one line: there is nothing to save before a command begins."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where a shell has it ignored
        signal.signal(signal.SIGINT, _end_at_once)


def raise_on_interrupt() -> None:
    """Make Ctrl-C raise KeyboardInterrupt again, which stops a command in order."""
    if signal.getsignal(signal.SIGINT) is _end_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end_at_once(number: int, frame: Any) -> None:
    try:
        os.write(2, b"\ninterrupted\n")
    finally:
        os._exit(EXIT_INTERRUPTED)


def imports_of(value: str) -> tuple[list[str], str]:
    """Return the modules that `IMPORTS_VARIABLE` names, and the folder in which some are found, or nothing."""
    names, _, folder = value.partition("=")
    return [name for name in names.split(",") if name], folder


class NamedModules:
    """Finds the modules of `--import` in a folder, if they are nowhere else; no other module is searched there."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.names: set[str] = set()
        """Top-level names of the modules."""
        self.used = False
        """Whether a module was found here."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return where the module `name` is, if it is one of the named ones."""
        spec = PathFinder.find_spec(name, [self.folder]) if path is None and name in self.names else None
        self.used = self.used or spec is not None
        return spec


def search_folder(folder: str, modules: Iterable[str]) -> NamedModules:
    """Search `folder` last for `modules`, and for those named before, from now on; return the finder."""
    known = [entry for entry in sys.meta_path if isinstance(entry, NamedModules) and entry.folder == folder]
    finder = known[0] if known else NamedModules(folder)
    if not known:
        sys.meta_path.append(finder)
    finder.names.update(module.partition(".")[0] for module in modules)
    return finder

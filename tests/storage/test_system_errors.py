"""Some errors of the system pass, others stay."""

from __future__ import annotations

import errno

import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.system_errors import in_words, is_momentary, momentary_cause


@pytest.mark.parametrize("name", ["ENOSPC", "EDQUOT", "EIO", "ESTALE", "ENOLCK", "EROFS", "EMFILE"])
def test_what_the_system_may_mend_is_momentary(name: str) -> None:
    assert is_momentary(getattr(errno, name))


@pytest.mark.parametrize("name", ["EACCES", "EPERM", "ENOTDIR", "EISDIR", "ENOENT", "ENAMETOOLONG", "ELOOP"])
def test_what_the_user_must_mend_is_not(name: str) -> None:
    assert not is_momentary(getattr(errno, name))


def test_an_error_without_a_number_is_not() -> None:
    assert not is_momentary(OSError("odd").errno)


def test_the_cause_of_an_error_is_found_below_others() -> None:
    full, refused = OSError(errno.ENOSPC, ""), PermissionError(errno.EACCES, "")
    assert momentary_cause(full) == errno.ENOSPC
    assert momentary_cause(refused) is None
    assert momentary_cause(UserError("of the user's own")) is None
    told = UserError("cannot read")
    told.__cause__ = full
    assert momentary_cause(told) == errno.ENOSPC


def test_an_error_is_told_with_its_file() -> None:
    assert in_words(OSError(errno.ENOSPC, "No space left on device", "a/b")) == "No space left on device: a/b"
    assert in_words(OSError(errno.ENOSPC, "No space left on device")) == "No space left on device"
    assert in_words(OSError("odd")) == "odd"
    assert in_words(OSError()) == "OSError"

"""Methods are found by name."""

from __future__ import annotations

import pytest

from codesign_bench.errors import UserError
from codesign_bench.method import Method, load_method, method_names


def test_a_method_is_loaded_by_its_name_as_a_class() -> None:
    for name in method_names():
        method_class = load_method(name)
        assert issubclass(method_class, Method)
        assert method_class.name == name


def test_a_registered_method_is_known(toy: None) -> None:
    assert method_names()[-1] == "toy_search"
    assert load_method("toy_search").label == "Toy search"


def test_an_unknown_method_is_answered_with_those_there_are() -> None:
    with pytest.raises(UserError, match="unknown method 'guess'; choose from: gnn_ppo, ") as told:
        load_method("guess")
    assert all(name in str(told.value) for name in method_names())

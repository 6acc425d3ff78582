"""Settings know where they come from, and survive a cell file."""

from __future__ import annotations

import json

import pytest

from codesign_bench.config.settings import Sourced, StoredConfig, plain, sourced


def test_values_share_a_source() -> None:
    assert sourced({"steps": 10, "epochs": 4}, "ours") == {"steps": (10, "ours"), "epochs": (4, "ours")}


def test_a_configuration_is_read_as_it_was_written() -> None:
    config = StoredConfig(run={"steps": Sourced(1000, "default")}, method={"widths": Sourced([8, 8], "table 1")})
    written = json.loads(json.dumps(config.to_json()))
    assert written["method"]["widths"] == {"value": [8, 8], "source": "table 1"}
    assert StoredConfig.from_json(written) == config
    assert config.parts == {"run": config.run, "method": config.method}


@pytest.mark.parametrize(
    "content", [{"run": {}}, {"run": {}, "method": {"epochs": {"value": 4}}}, {"run": {}, "method": {"epochs": 4}}]
)
def test_what_has_another_form_is_no_configuration(content: dict) -> None:
    with pytest.raises((KeyError, TypeError, AttributeError)):
        StoredConfig.from_json(content)


def test_tuples_compare_with_the_lists_that_json_makes_of_them() -> None:
    assert plain((1, (2.5, "a"), None)) == [1, [2.5, "a"], None]
    assert plain(0.1) == 0.1

"""Record what rliable says of the scores in `rliable.json`; `tests/stats` compares our statistics with it.

rliable 1.2.0 does not import beside pandas 3, so it runs in an environment of its own:

    python3.11 -m venv rliable-venv && rliable-venv/bin/pip install "rliable==1.2.0" "pandas<3" "numpy<2.3"
    rliable-venv/bin/python tests/data/measure_rliable.py tests/data/rliable.json

Scores have the shape (runs, tasks), as rliable wants them.
"""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rliable import library, metrics

RESAMPLES = 20_000
THRESHOLDS = [-0.5, 0.0, 0.25, 0.5, 0.9, 1.5]


def scores() -> tuple[np.ndarray, np.ndarray]:
    """Return scores of two methods on three tasks, 6 and 5 runs, rounded so that some are equal."""
    rng = np.random.default_rng(2021)
    first = rng.normal(loc=[0.6, 0.4, 0.2], scale=0.3, size=(6, 3))
    second = rng.normal(loc=[0.3, 0.5, 0.0], scale=0.3, size=(5, 3))
    return first.round(1), second.round(1)


def interval(values: object, function: object) -> list[float]:
    """Return rliable's 95 % percentile interval of a number."""
    np.random.seed(0)  # noqa: NPY002  # rliable draws from the global generator, whatever it is given
    _, intervals = library.get_interval_estimates({"x": values}, function, reps=RESAMPLES)
    return [float(end) for end in np.ravel(intervals["x"])]


def main(path: Path) -> None:
    """Write scores and numbers to `path`."""
    first, second = scores()
    profiles, _ = library.create_performance_profile({"x": first}, np.array(THRESHOLDS), reps=RESAMPLES)
    content = {
        "made_with": {name: version(name) for name in ("rliable", "arch", "numpy", "scipy", "pandas")},
        "resamples": RESAMPLES,
        "first": first.tolist(),
        "second": second.tolist(),
        "mean": float(metrics.aggregate_mean(first)),
        "interquartile_mean": float(metrics.aggregate_iqm(first)),
        "interquartile_mean_interval": interval(first, lambda x: np.array([metrics.aggregate_iqm(x)])),
        "probability_of_improvement": float(metrics.probability_of_improvement(first, second)),
        "thresholds": THRESHOLDS,
        "performance_profile": profiles["x"].tolist(),
    }
    path.write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

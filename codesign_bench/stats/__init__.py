"""Statistics over seeds: arrays or frames in, numbers or frames out, without files or figures."""

from codesign_bench.stats.bootstrap import (
    CONFIDENCE,
    RESAMPLES,
    bootstrap,
    bootstrap_interval,
    final_rng,
    mean_difference_interval,
    mean_interval,
)
from codesign_bench.stats.curves import CELL_KEYS, curve_intervals, curve_statistics, final_values, on_common_grid
from codesign_bench.stats.improvement import (
    performance_profile,
    performance_profile_interval,
    probability_of_improvement,
    probability_of_improvement_interval,
)
from codesign_bench.stats.normalization import Reference, normalized_score
from codesign_bench.stats.summaries import MIN_SEEDS, interquartile_mean, mean, standard_error

__all__ = [
    "CELL_KEYS",
    "CONFIDENCE",
    "MIN_SEEDS",
    "RESAMPLES",
    "Reference",
    "bootstrap",
    "bootstrap_interval",
    "curve_intervals",
    "curve_statistics",
    "final_rng",
    "final_values",
    "interquartile_mean",
    "mean",
    "mean_difference_interval",
    "mean_interval",
    "normalized_score",
    "on_common_grid",
    "performance_profile",
    "performance_profile_interval",
    "probability_of_improvement",
    "probability_of_improvement_interval",
    "standard_error",
]

"""Statistics over seeds: arrays or frames in, numbers or frames out, without files or figures."""

from codesign_bench.stats.bootstrap import RESAMPLES, bootstrap
from codesign_bench.stats.curves import CELL_KEYS, curve_statistics, final_values, on_common_grid
from codesign_bench.stats.improvement import performance_profile, probability_of_improvement
from codesign_bench.stats.multiplicity import holm
from codesign_bench.stats.normalization import Reference, normalized_score
from codesign_bench.stats.permutation import difference_p, jonckheere_p, sign_flip_p, stratified_p
from codesign_bench.stats.plateau import late_gains
from codesign_bench.stats.proportions import proportion_interval, proportion_test
from codesign_bench.stats.reaching import mean_along, monotone, steps_to_reach
from codesign_bench.stats.student import (
    CONFIDENCE,
    Estimate,
    equivalent,
    mean_across,
    mean_t_interval,
    one_sample_t,
    welch,
    welch_across,
)
from codesign_bench.stats.summaries import MIN_SEEDS, interquartile_mean, mean, standard_error

__all__ = [
    "CELL_KEYS",
    "CONFIDENCE",
    "MIN_SEEDS",
    "RESAMPLES",
    "Estimate",
    "Reference",
    "bootstrap",
    "curve_statistics",
    "difference_p",
    "equivalent",
    "final_values",
    "holm",
    "interquartile_mean",
    "jonckheere_p",
    "late_gains",
    "mean",
    "mean_across",
    "mean_along",
    "mean_t_interval",
    "monotone",
    "normalized_score",
    "on_common_grid",
    "one_sample_t",
    "performance_profile",
    "probability_of_improvement",
    "proportion_interval",
    "proportion_test",
    "sign_flip_p",
    "standard_error",
    "steps_to_reach",
    "stratified_p",
    "welch",
    "welch_across",
]

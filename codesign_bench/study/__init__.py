"""The interface of a study; a new study imports everything it needs from here.

`experiment.py` defines experiments, `tuning.py` the search of settings, `study.py` the study itself.
"""

from codesign_bench.study.experiment import Experiment, Grid, Measure, stages_of
from codesign_bench.study.study import DEFAULT_STUDY, Study, load_study, study_names
from codesign_bench.study.tuning import FIRST_REPORTED_SEED, Tuning

__all__ = [
    "DEFAULT_STUDY",
    "FIRST_REPORTED_SEED",
    "Experiment",
    "Grid",
    "Measure",
    "Study",
    "Tuning",
    "load_study",
    "stages_of",
    "study_names",
]

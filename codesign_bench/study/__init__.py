"""The interface of a study; a new study imports everything it needs from here.

`experiment.py` defines experiments, `study.py` the study itself.
"""

from codesign_bench.study.experiment import Experiment, Grid, Measure, stages_of
from codesign_bench.study.study import DEFAULT_STUDY, Study, load_study, study_names

__all__ = ["DEFAULT_STUDY", "Experiment", "Grid", "Measure", "Study", "load_study", "stages_of", "study_names"]

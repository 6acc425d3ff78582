"""Reference results of codesign-bench, in the folder `reference` beside this file; there is no code."""

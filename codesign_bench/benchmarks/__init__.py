"""Speed on this machine, for `codesign-bench bench`: compared in the same run, never asserted in a test."""

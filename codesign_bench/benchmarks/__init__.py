"""Speed on the machine at hand, for `codesign-bench bench`: measured side by side, never asserted in a test."""

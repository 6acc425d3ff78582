"""One page on a results folder: figures, numbers, failures, and provenance."""

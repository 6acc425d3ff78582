"""One page that tells all of a results folder: figures, numbers, failures, and how everything was made."""

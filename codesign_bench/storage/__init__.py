"""Results on disk: atomic writes, the layout of a results folder, checkpoints and policies."""

"""Results on disk: files written whole or not at all, the layout of a results folder, checkpoints, policies."""

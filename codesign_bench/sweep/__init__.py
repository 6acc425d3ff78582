"""Run cells: the plan, worker processes and clusters, one cell from start to end, and the progress display."""

"""Cells: a task, a method, a variant and a seed, as plain values."""

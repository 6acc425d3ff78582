"""Behaviour written by hand, one file per task: designers and controllers that show how a task can be solved."""

"""Hand-written designers and controllers, one file per task, that show how a task can be solved."""

"""One file per task, with its physics, reward and goal space. Files with an underscore are shared by several tasks."""

ORDER = ("push", "catch_balls", "scoop", "fetch_cube", "lift_cup", "scoop_3d", "bounce", "gather")
"""The order in listings and figures."""

"""One file, one task: its physics, its reward, its goal space. Files with an underscore hold what several share."""

ORDER = ("push", "catch_balls", "scoop", "fetch_cube", "lift_cup", "scoop_3d")
"""The order in listings and figures."""

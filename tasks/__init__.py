"""One file, one task: its physics, its reward, its goal space. Files with an underscore hold what several share."""

ORDER = ("push",)
"""The order in listings and figures."""

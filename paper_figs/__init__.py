"""One file, one figure: `draw(results) -> Figure` from results alone; nothing here trains anything."""

ORDER = ("learning_curves",)
"""The order in listings and reports."""

"""One file, one figure: `draw(results) -> Figure` from results alone; nothing here trains anything."""

ORDER = ("learning_curves", "learning_curves_iqm")
"""The order in listings and reports."""

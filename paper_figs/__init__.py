"""One file, one figure: `draw(results) -> Figure` from results alone; nothing here trains anything."""

ORDER = ("learning_curves", "learning_curves_iqm", "final_results")
"""The order in listings and reports."""

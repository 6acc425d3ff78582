"""One file per figure, drawn only from results; no figure trains anything."""

ORDER = ("learning_curves", "learning_curves_iqm", "final_results")
"""The order in listings and reports."""

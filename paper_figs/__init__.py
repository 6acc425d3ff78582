"""One file, one figure: `draw(frame) -> Figure` from the frame that its `SOURCE` makes; nothing is trained here."""

ORDER = ("learning_curves", "learning_curves_iqm", "final_results")
"""The order in listings and reports."""

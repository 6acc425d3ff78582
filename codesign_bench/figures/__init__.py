"""Figures from results: where their numbers come from, and how files are made of them."""

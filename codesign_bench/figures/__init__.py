"""Figures from results: data sources and drawing."""

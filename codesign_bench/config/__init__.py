"""Configurations: profiles, settings as text, and resolution that records the source of every value."""

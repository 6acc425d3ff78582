"""Configurations: profiles, the values of settings as text, and their resolution with every value's source."""

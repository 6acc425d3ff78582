"""A task and two methods that live outside codesign-bench: one file each."""

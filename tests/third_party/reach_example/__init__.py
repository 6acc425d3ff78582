"""A task and a method that live outside codesign-bench: one file each."""

"""A task and two methods outside of codesign-bench, one file each."""

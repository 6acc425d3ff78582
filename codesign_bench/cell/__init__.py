"""What one run is: a task, a method, a variant and a seed, as plain values."""

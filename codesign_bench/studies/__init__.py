"""One file or folder per study."""

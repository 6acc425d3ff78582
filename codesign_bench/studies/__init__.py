"""One file or folder, one study."""

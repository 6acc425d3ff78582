"""Convert designs to printable solids."""

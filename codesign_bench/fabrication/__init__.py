"""From a design to a solid that can be printed."""

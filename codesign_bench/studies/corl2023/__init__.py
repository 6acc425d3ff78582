"""The study of the paper: "Learning to Design and Use Tools for Robotic Manipulation" (CoRL 2023)."""

"""Short names of the types in the paper's tables."""

Interval = tuple[float, float]
Triple = tuple[float, float, float]

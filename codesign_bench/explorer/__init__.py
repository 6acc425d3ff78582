"""A page in which goals are dragged, and designers, tools and recorded rollouts answer."""

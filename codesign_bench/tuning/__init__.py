"""Search settings: the candidates of a method, their cells in each rung, the scores, and the tables of the results."""

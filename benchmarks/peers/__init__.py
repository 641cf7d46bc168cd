"""Solvers of others, each given the same body, the same frames and the same start."""

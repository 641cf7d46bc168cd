"""Compiled kernels of Voronoi diagrams and natural-neighbor weights."""

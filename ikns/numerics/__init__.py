"""Numerics without reference to bodies: rigid motions, subspaces, derivatives."""

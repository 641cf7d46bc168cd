"""Numerics that know nothing of bodies: rigid motions, subspaces, derivatives."""

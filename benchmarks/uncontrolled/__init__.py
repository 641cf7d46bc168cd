"""Reaches for the uncontrolled manifold: of real people, and simulated."""

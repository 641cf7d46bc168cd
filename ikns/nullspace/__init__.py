"""The null space learned from samples: clustering, interpolation, the map."""

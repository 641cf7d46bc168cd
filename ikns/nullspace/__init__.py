"""The null space learned from samples: clustering, interpolation and the map."""

"""Clusters of hand positions: the smallest box around them, and k-means from there."""

from ikns.nullspace.clustering.bounding_box import (
    BoundingBox,
    box_surface_points,
    minimum_bounding_box,
)
from ikns.nullspace.clustering.kmeans import BoundingBoxKMeans, nearest_center

__all__ = [
    "BoundingBox",
    "BoundingBoxKMeans",
    "box_surface_points",
    "minimum_bounding_box",
    "nearest_center",
]

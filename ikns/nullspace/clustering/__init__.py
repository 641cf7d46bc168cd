"""Clusters of hand positions: the smallest box around them, and k-means from there."""

from typing import TYPE_CHECKING, Any

from ikns.nullspace.clustering.bounding_box import (
    BoundingBox,
    box_surface_points,
    minimum_bounding_box,
)
from ikns.nullspace.clustering.nearest import nearest_center

if TYPE_CHECKING:
    from ikns.nullspace.clustering.kmeans import BoundingBoxKMeans

__all__ = [
    "BoundingBox",
    "BoundingBoxKMeans",
    "box_surface_points",
    "minimum_bounding_box",
    "nearest_center",
]


def __getattr__(name: str) -> Any:
    """Load what is fitted on first use."""
    if name != "BoundingBoxKMeans":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}.")
    from ikns.nullspace.clustering.kmeans import BoundingBoxKMeans

    return BoundingBoxKMeans

"""Natural-neighbor interpolation in space: exact Sibson weights on any layout.

The formula is in `sibson`, the diagram that it cuts in `voronoi`, the triangulation
behind that in `delaunay`: references for the compiled forms that do the work.
"""

from ikns.nullspace.interpolation.natural_neighbor import NaturalNeighborInterpolator

__all__ = ["NaturalNeighborInterpolator"]

"""Natural-neighbor interpolation in space: exact Sibson weights on any layout.

`natural_neighbor` is what is used; `diagram` builds the Voronoi diagram of the sites,
`packed` lays it out for the compiled queries in ikns._kernels.voronoi.
"""

from ikns.nullspace.interpolation.natural_neighbor import NaturalNeighborInterpolator

__all__ = ["NaturalNeighborInterpolator"]

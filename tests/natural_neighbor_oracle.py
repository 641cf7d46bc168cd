"""Natural-neighbor weights and values in NumPy, all queries at once, step by step.

A query is scaled and brought near, placed by the rule for queries outside the hull,
moved in by a skin, and given its coordinates from the lengths and angles of the
diagram, which `diagram_oracle` holds to exact arithmetic. The kernels take the same
steps for one query, through a walk or in a row of others.
"""

import numpy as np

from ikns.nullspace.interpolation.domain import domain
from ikns.nullspace.interpolation.double_double import difference, double_double_dot

#: Part of the way from the hull to the middle that queries near the hull are moved to.
SKIN = 1e-11
#: Farther queries are brought this near.
FAR = 1e9
#: Where a product is below this part of its terms, it is formed again with twice the
#: digits.
CANCELED = 1e-3


def weights(net, x):
    """Weights of the sites at queries (Q, 3), m; NaN where there are none."""
    return _weights(net, domain(net.points), x)[0]


def values(net, x):
    """Values (Q, M) at queries (Q, 3), m."""
    space = domain(net.points)
    found, places = _weights(net, space, x)
    flat = net.values.reshape(len(net.points), -1)
    if net.method != "sibson_c1":
        return found @ flat
    slopes = net.gradients.reshape(*flat.shape, 3) / space.scale
    return _smooth(space, places, found, flat, slopes)


def _weights(net, space, x):
    """Weights (Q, N), and where they hold, (Q, 3) scaled."""
    places = _scaled(space, x)
    found = np.full((len(places), len(space.sites)), np.nan)
    seen = np.flatnonzero(np.isfinite(places).all(axis=1))
    d = space.diagram
    depth = _depths(d, space.sites, places[seen], np.zeros_like(places[seen]))
    within = depth.min(axis=1, initial=np.inf) >= -space.rounding
    away, rows = seen[~within], seen[within]
    if net.outside == "nearest":
        found[away] = np.eye(len(space.sites))[_nearest(space, places[away])[0]]
    if net.outside == "project":
        places[away] = nearest_on_hull(space.sites, d.hull_facets, places[away])
        rows = seen
    nearest, square = _nearest(space, places[rows])
    at_site = square <= 1e-36  # nearer, nothing could be told apart
    found[rows[at_site]] = np.eye(len(space.sites))[nearest[at_site]]
    rows = rows[~at_site]
    laplace = net.method == "laplace"
    found[rows], places[rows] = _inside(space, places[rows], laplace)
    return found, places


def _scaled(space, x):
    """Bring queries near, in the domain's units; where they overflow, infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        queries = x * space.scale
        away = queries - space.center
        reach = np.abs(away).max(axis=1, initial=0)
        far = (reach > FAR) & np.isfinite(reach)
    queries[far] = space.center + away[far] / reach[far, None] * FAR
    return queries


def _nearest(space, x):
    """Nearest sites, and the squares of their distances."""
    square = ((x[:, None] - space.sites) ** 2).sum(axis=2)
    nearest = square.argmin(axis=1)
    return nearest, square[np.arange(len(x)), nearest]


def _inside(space, x, laplace):
    """Weights of queries in the hull that are not sites, and the queries, moved in."""
    d = space.diagram
    # Part of the way from the hull to the middle: linear along every such ray.
    depth = _depths(d, space.sites, x, np.zeros_like(x))
    part = (depth / space.center_depth).min(axis=1, initial=np.inf)
    x, rest = x.copy(), np.zeros_like(x)  # may move by less than floats can tell
    low = np.flatnonzero(part < SKIN)
    step = (SKIN - part[low]) / (1 - part[low])
    x[low], rest[low] = difference(x[low], step[:, None] * (x[low] - space.center))
    depth[low] = _depths(d, space.sites, x[low], rest[low])
    found = _coordinates(d, space.sites, x, rest, depth, laplace)
    found /= found.sum(axis=1, keepdims=True)
    assert (found >= -1e-9).all()  # rounding leaves -1e-15
    found = found.clip(0, None)
    return found / found.sum(axis=1, keepdims=True), x


def _depths(d, sites, x, x_rest):
    """How far points lie behind each facet of the hull, (Q, H); positive inside."""
    site = sites[d.hull_facets[:, 0]]
    normal, normal_rest = d.normal[d.hull], d.normal_rest[d.hull]
    depth = np.einsum("hk,qhk->qh", normal, site - x[:, None])
    q, h = np.nonzero(np.abs(depth) < CANCELED)
    p, p_rest = difference(site[h], x[q])
    depth[q, h] = double_double_dot(normal[h], normal_rest[h], p, p_rest - x_rest[q])
    return depth


def _powers(d, sites, x, x_rest):
    """Squared radius less squared distance to the query, (Q, T)."""
    site = sites[d.simplices[:, 0]]
    p = x[:, None] - site
    power = np.einsum("qtk,qtk->qt", 2 * d.circumcenter - p, p)
    scale = 1 + np.abs(d.circumcenter).max(axis=1)
    q, t = np.nonzero(np.abs(power) < CANCELED * scale)
    p, p_rest = difference(x[q], site[t])
    p_rest = p_rest + x_rest[q]
    reach, reach_rest = difference(2 * d.circumcenter[t], p)
    reach_rest = reach_rest + 2 * d.circumcenter_rest[t] - p_rest
    power[q, t] = double_double_dot(reach, reach_rest, p, p_rest)
    return power


def _coordinates(d, sites, x, x_rest, depth, laplace):
    """Sibson's or Laplace's coordinates (Q, N), before they are normalized.

    The formulas are in ikns._kernels.voronoi.sibson.
    """
    area = _kept_areas(d, sites, x, x_rest, depth)
    found = np.zeros((len(sites), len(x)))
    i, j = d.edges.T
    for mine, other, sign in ((i, j, 1.0), (j, i, -1.0)):
        p = sites[mine if laplace else other] - x[:, None]
        along = np.einsum("ek,qek->qe", sign * d.axis, p)
        np.add.at(found, mine, (area * along).T)
    if not laplace:
        return found.T / 12
    return -found.T / ((sites - x[:, None]) ** 2).sum(axis=2)


def _kept_areas(d, sites, x, x_rest, depth):
    """Twice the area of each Voronoi face on the query's side, (Q, E)."""
    power = np.empty((len(x), len(d.simplices) + 1))
    power[:, :-1] = _powers(d, sites, x, x_rest)
    power[:, -1] = -np.inf
    inside = power > 0
    kept = _kept_lengths(d, power, inside, depth)[:, d.side_facet]
    start = np.zeros((len(x), len(d.edges)), dtype=np.intp)
    q, side = np.nonzero(~inside[:, d.entering] & inside[:, d.leaving])
    start[q, d.side_edge[side]] = side
    start = start[:, d.side_edge[d.first]]
    swapped = (d.first < start) & (start <= d.second)
    area = kept[:, d.first] * kept[:, d.second] * np.where(swapped, -d.sine, d.sine)
    return np.add.reduceat(area, d.pairs, axis=1)


def _kept_lengths(d, power, inside, depth):
    """Length of each facet's Voronoi edge on the query's side, (Q, F)."""
    behind, ahead = power[:, d.behind], power[:, d.ahead]
    share = np.zeros_like(behind)
    from_behind = inside[:, d.behind] & ~inside[:, d.ahead]
    from_ahead = inside[:, d.ahead] & ~inside[:, d.behind]
    share[inside[:, d.behind] & inside[:, d.ahead]] = 1
    np.divide(behind, behind - ahead, out=share, where=from_behind)
    np.divide(ahead, ahead - behind, out=share, where=from_ahead)
    share[:, d.hull] = behind[:, d.hull].clip(0, None) / (2 * depth)
    return share * np.where(np.isfinite(d.length), d.length, 1.0)


def _smooth(space, places, found, values, gradients):
    """Sibson's Z1 (Q, M); the formula is in ikns._kernels.voronoi.answer."""
    p = space.sites - places[:, None]
    distance = np.linalg.norm(p, axis=2)
    one_site = (found == 1).any(axis=1)
    distance[one_site] = 1
    plain = found @ values
    near = found / distance
    nearness = near.sum(axis=1)
    alpha = (found * distance).sum(axis=1) / nearness
    beta = (found * distance**2).sum(axis=1)
    rise = np.einsum("qn,nmk,qnk->qm", near, gradients, p)
    tangents = (near @ values - rise) / nearness[:, None]
    share = np.where(one_site, 0, beta / (alpha + beta))[:, None]
    return (1 - share) * plain + share * tangents


def nearest_on_hull(sites, facets, x):
    """Project queries (Q, 3) outside a convex hull with facets (H, 3) onto it.

    All sites lie behind the plane through the nearest point y that is normal to x - y.
    Comparing distances alone would give y only to 1e-8, because they are stationary
    there; so distances choose a few candidates and the sites choose y.
    """
    a, b, c = (sites[facets[:, k]] for k in range(3))
    candidates = np.concatenate(
        [
            _on_planes(a, b, c, x),
            _on_segments(a, b, x),
            _on_segments(b, c, x),
            _on_segments(c, a, x),
        ],
        axis=1,
    )
    square = ((x[:, None] - candidates) ** 2).sum(axis=2)
    q, k = np.nonzero(square <= square.min(axis=1, keepdims=True) * (1 + 1e-12))
    y = candidates[q, k]
    vertices = sites[np.unique(facets)]
    ahead = np.einsum("mk,mnk->mn", x[q] - y, vertices - y[:, None]).max(axis=1)
    best = np.lexsort((ahead, q))
    return y[best[np.searchsorted(q, np.arange(len(x)))]]


def _on_segments(a, b, x):
    """Nearest points of H segments to Q points, (Q, H, 3)."""
    along = b - a
    t = np.einsum("hk,qhk->qh", along, x[:, None] - a) / (along * along).sum(axis=1)
    return a + t.clip(0, 1)[..., None] * along


def _on_planes(a, b, c, x):
    """Feet of Q points on H triangles, (Q, H, 3); a vertex where the foot is off."""
    u, v = b - a, c - a
    normal = np.cross(u, v)
    square = (normal * normal).sum(axis=1)
    w = x[:, None] - a
    with np.errstate(divide="ignore", invalid="ignore"):  # triangles flat to rounding
        s = np.einsum("hk,qhk->qh", np.cross(v, normal), w) / square
        t = np.einsum("hk,qhk->qh", np.cross(normal, u), w) / square
        on = (s >= 0) & (t >= 0) & (s + t <= 1)
    s, t = np.where(on, s, 0.0), np.where(on, t, 0.0)
    return a + s[..., None] * u + t[..., None] * v

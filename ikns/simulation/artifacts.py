"""Artifacts of markers: soft tissue and occlusion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.chains import SIDES, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.simulation.wander import wander

#: Shares of the variance: the cluster moves as one, each marker moves with the posture,
#: each marker moves slowly at random. Translations and rotations of the whole
#: cluster dominate (Andersen et al. 2012, Gait & Posture 35:606); the numbers are ours.
_CLUSTER, _OWN, _RANDOM = 0.5, 0.25, 0.25
#: Cut-off of the random part, Hz: slow slip and muscle contraction (assumption).
_RANDOM_HZ = 0.3
#: Distance from the middle of the cluster at which rotation and translation of the
#: cluster move a marker equally, m: the radius of an upper arm.
_LEVER = 0.05
#: Shortest, mean and longest duration of an occlusion, s (assumption).
_BURST_S = (0.05, 0.12, 0.30)
#: Share of occlusions that hide neighbors on the same segment too (assumption).
_TOGETHER = 0.3


class SoftTissue:
    """Soft tissue artifact: displacement of markers over bone with the posture.

    The displacement of a marker is linear in the angles of the joints at both ends of
    its segment, counted from a reference posture (a linear model explains about 95 % of
    the variance seen with bone pins, Andersen et al. 2012, Gait & Posture 35:606). One
    part shifts and turns all markers of a segment alike, one is each marker's own;
    a slow random part is added. Directions are random, drawn once per person.

    `size` is the root mean square length of the displacement over `angles` (T, 18), on
    average over the markers of a segment, m; the same for every segment. `reference`
    (18,) are joint angles without displacement.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        size: float,
        *,
        reference: Array,
        angles: Array,
        rng: np.random.Generator,
    ) -> None:
        self.skeleton, self.size, self.reference = skeleton, size, reference
        markers = skeleton.marker_set.markers
        self.links = np.array([marker.link for marker in markers])
        n_joints = len(skeleton.joint_names)
        self._gains = np.zeros((len(markers), 3, n_joints))
        places = skeleton.marker_positions
        for link in np.unique(self.links):
            rows = self.links == link
            near = np.array(
                [joint in _joints_at(str(link)) for joint in skeleton.joint_names]
            )
            shift = rng.normal(size=(3, n_joints)) * near
            turn = rng.normal(size=(3, n_joints)) * near / _LEVER
            arms = places[rows] - places[rows].mean(axis=0)
            cluster = shift + np.cross(turn.T[None], arms[:, None], axis=2).swapaxes(
                1, 2
            )
            own = rng.normal(size=(int(rows.sum()), 3, n_joints)) * near
            for share, gains in ((_CLUSTER, cluster), (_OWN, own)):
                length = np.linalg.norm(self._moved(gains, angles), axis=2)
                rms = np.sqrt(np.mean(length**2))
                self._gains[rows] += gains * (size * np.sqrt(share) / rms)

    def displacement(self, q: Array, *, rate: float, rng: np.random.Generator) -> Array:
        """Displacement of the markers in the world, (T, M, 3) m, at q (T, nq)."""
        local = self.with_posture(q) + self.at_random(len(q), rate=rate, rng=rng)
        return self.in_world(q, local)

    def with_posture(self, q: Array) -> Array:
        """Return the part due to posture, in the frames of the segments, (T, M, 3)."""
        return self._moved(self._gains, q[:, -len(self.reference) :])

    def at_random(self, n: int, *, rate: float, rng: np.random.Generator) -> Array:
        """Return the random part, in the frames of the segments, (n, M, 3)."""
        m, sd = len(self.links), self.size * np.sqrt(_RANDOM / 3)
        slow = wander(rng, n, 3 * m, sd=sd, cutoff=_RANDOM_HZ, rate=rate)
        return slow.reshape(n, m, 3)

    def in_world(self, q: Array, local: Array) -> Array:
        """Rotate displacements from the frames of the segments to the world."""
        in_world = np.empty_like(local)
        root = Rotation.from_quat(q[:, 3:7]).as_matrix()
        for link in np.unique(self.links):
            rows = self.links == link
            turned = root @ self.skeleton.link_in_thorax(q, str(link))[1]
            in_world[:, rows] = local[:, rows] @ np.swapaxes(turned, 1, 2)
        return in_world

    def _moved(self, gains: Array, angles: Array) -> Array:
        return np.asarray(np.einsum("mkj,tj->tmk", gains, angles - self.reference))


def occlusions(
    rng: np.random.Generator,
    n: int,
    links: NDArray[np.str_],
    *,
    share: float,
    rate: float,
) -> NDArray[np.bool_]:
    """Return which markers the cameras miss, in bursts, (n, M).

    Bursts of geometrically distributed length start at random, until `share` of all
    marker frames is hidden. Some hide one or two more markers of the same segment
    (`links`, one a marker).
    """
    if not 0 <= share <= 0.5:
        raise InvalidInput(
            f"expected a share of occluded markers from 0 to 0.5, found {share}."
        )
    hidden = np.zeros((n, len(links)), dtype=bool)
    shortest, mean, longest = (max(1, round(s * rate)) for s in _BURST_S)
    while np.count_nonzero(hidden) / hidden.size < share:
        burst = shortest + rng.geometric(1 / (mean - shortest + 1)) - 1
        start = rng.integers(-shortest, n)
        rows = slice(max(0, start), start + min(burst, longest))
        marker = rng.integers(len(links))
        columns = [marker]
        neighbors = np.flatnonzero(links == links[marker])
        neighbors = neighbors[neighbors != marker]
        if len(neighbors) and rng.random() < _TOGETHER:
            count = min(len(neighbors), int(rng.integers(1, 3)))
            columns.extend(rng.choice(neighbors, count, replace=False))
        hidden[rows, columns] = True
    return hidden


def _joints_at(link: str) -> set[str]:
    """Return the joints at both ends of a segment."""
    if link == "thorax":
        return {j for s in SIDES for j in chain_joints(f"{s}_arm_clavicle")[:5]}
    side, segment = link.split("_", 1)
    names = chain_joints(f"{side}_arm_clavicle")
    spans = {
        "clavicle": slice(0, 5),
        "upper_arm": slice(2, 6),
        "forearm": slice(5, 9),
        "hand": slice(7, 9),
    }
    return set(names[spans[segment]])

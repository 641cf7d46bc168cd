"""One live frame, from markers to the control signal, in one compiled call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns._kernels.body.control_frame import ControlMap, control_frame
from ikns._kernels.voronoi.diagram import INSIDE_HULL, new_work
from ikns.body.chains import SIDES, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.control.intent import IntentSignal
from ikns.motion.marker_ik.kernel import KernelSolver
from ikns.motion.marker_ik.visibility import sight_needs
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.interpolator import NearestPoint
from ikns.nullspace.readout import Readout

Array = NDArray[np.float64]


class ControlFrame(NamedTuple):
    """Pose and control signal of one frame.

    Parameters
    ----------
    c : (d,) array
        Control signals, not clipped; NaN while the chain is not in sight, and where
        :meth:`ikns.NullSpaceMap.control_signal` is.
    q : (nq,) array
        Configuration of the skeleton.
    hand_in_thorax : (3,) array
        Task position, m.
    in_sight : bool
        Whether every segment of the chain was seen.
    inside : bool
        Whether the hand is among the points of the map; false out of sight and where
        the weights of the points cannot be trusted.
    residual : float
        Root mean square distance between pose and markers, m; NaN without markers.
    worst_residual : float
        Largest distance between pose and a marker of the chain, m; NaN without any.
    intermarker_error : float
        Largest difference between the distance of two markers of a segment and that on
        the person's skeleton, m; 0 where no two are seen.
    iterations : int
    converged : bool
    """

    c: Array
    q: Array
    hand_in_thorax: Array
    in_sight: bool
    inside: bool
    residual: float
    worst_residual: float
    intermarker_error: float
    iterations: int
    converged: bool


class FrameSolver:
    """Solve successive frames, each starting from the pose before.

    Does the same as :meth:`ikns.MarkerIK.solve`, the hand position, and
    :meth:`ikns.NullSpaceMap.control_signal` in sequence, but in one compiled call. It
    keeps the pose and work memory, so use one per thread.

    Parameters
    ----------
    skeleton : Skeleton
    null_space_map : NullSpaceMap
        Fitted, for `chain`.
    chain : str
        See :data:`ikns.body.chains.CHAINS`.
    readout : Readout, optional
        Of this skeleton and chain: what reads c instead of the map, by a second
        compiled call. Live these are ``"paper"``, which changes nothing, and
        ``"intent"``, for which `inside` says where natural movement was taught.

    Raises
    ------
    InvalidInput
        When the map is of other joints or the readout of another chain, or the kernels
        do not know one of them.

    Examples
    --------
    >>> import numpy as np
    >>> skeleton = Skeleton.load()
    >>> corners = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    >>> one = np.ones(8)
    >>> learned = NullSpaceMap.from_arrays(
    ...     corners, np.outer(one, np.eye(7)[1]), 0 * one, one
    ... )
    >>> solver = FrameSolver(skeleton, learned, "right_arm")
    >>> frame = solver.solve(skeleton.markers_in_world(skeleton.neutral()))
    >>> frame.in_sight, frame.converged
    (True, True)
    """

    def __init__(
        self,
        skeleton: Skeleton,
        null_space_map: NullSpaceMap,
        chain: str,
        *,
        readout: Readout | None = None,
    ) -> None:
        joints = chain_joints(chain)
        n = null_space_map.directions_.shape[2]
        if n != len(joints):
            raise InvalidInput(
                f"expected a map of the {len(joints)} joints of {chain}, found one of "
                f"{n} joints."
            )
        if null_space_map.centers_.shape[1] != 3:
            raise InvalidInput(
                "expected a map of points in space, found points with "
                f"{null_space_map.centers_.shape[1]} coordinates."
            )
        if readout is not None and readout.chain != chain:
            raise InvalidInput(
                f"expected a readout of {chain}, found one of {readout.chain}."
            )
        self.skeleton, self.null_space_map, self.chain = skeleton, null_space_map, chain
        self._signal: IntentSignal | None = None
        if readout is not None and readout.method != "paper":
            self._signal = IntentSignal(skeleton, readout)
        self._ik = KernelSolver(skeleton)
        self._paths = skeleton.hand_paths
        self._map = _control_map(skeleton, null_space_map, chain)
        self._cavity = (
            new_work(self._map.indices) if len(self._map.indices) else np.empty(0)
        )
        self._rotation, self._position = np.empty((1, 2, 3, 3)), np.empty((1, 2, 3))
        self._weights = np.empty(len(null_space_map.centers_))
        self._markers = np.empty((len(skeleton.marker_set.markers), 3))
        self._memory = self._ik.new_memory()
        self.reset()

    def reset(self, q: ArrayLike | None = None) -> None:
        """Forget the pose; start the next frame from `q`, or from scratch."""
        self._lost = q is None
        self._q = self.skeleton.neutral()
        if q is not None:
            given = np.asarray(q, dtype=np.float64)
            if given.shape != self._q.shape or not np.isfinite(given).all():
                raise InvalidInput(
                    f"expected a finite pose {self._q.shape}, found {given.shape}."
                )
            self._q[:] = given
        self._memory.start[:] = self._q

    def compile(self) -> None:
        """Compile or load what a frame out of sight does not run."""
        if self._signal is not None:
            self._signal(self.skeleton.neutral()[7:])

    def solve(self, markers: ArrayLike) -> ControlFrame:
        """Solve the next frame.

        Parameters
        ----------
        markers : (M, 3) array
            Positions in the world (m) in the order of the skeleton's marker set; NaN
            where not seen.
        """
        seen = np.asarray(markers, dtype=np.float64)
        if seen.shape != self._markers.shape:
            raise InvalidInput(
                f"expected markers {self._markers.shape}, found {seen.shape}."
            )
        self._markers[:] = seen
        place, c = np.empty(3), np.empty(self.null_space_map.directions_.shape[1])
        residual, worst, apart, iterations, converged, known, status = control_frame(
            *self._ik.packed,
            self._paths,
            self._ik.gate,
            self._map,
            self._markers,
            self._lost,
            self._memory,
            self._q,
            self._ik.work,
            self._cavity,
            self._rotation,
            self._position,
            self._weights,
            place,
            c,
        )
        self._lost = self._lost and not np.isfinite(residual)
        self._memory.start[:] = self._q
        q = self._q.copy()
        inside = status == INSIDE_HULL
        if self._signal is not None and known:
            c[0], inside = self._signal(q[7:])
        return ControlFrame(
            c, q, place, known, inside, residual, worst, apart, iterations, converged
        )


def _control_map(skeleton: Skeleton, learned: NullSpaceMap, chain: str) -> ControlMap:
    labels = list(skeleton.marker_set.labels)
    link = np.full(len(labels), -1, dtype=np.int64)
    need: list[int] = []
    for columns, least in sight_needs(skeleton, chain).values():
        link[columns] = len(need)
        need.append(least)
    interpolator = learned.interpolator_
    numbers, indices = np.empty(0), np.empty(0, dtype=np.int64)
    if isinstance(interpolator, NaturalNeighborInterpolator):
        numbers, indices = interpolator.packed
    elif not isinstance(interpolator, NearestPoint):
        raise InvalidInput(
            "expected a map between natural neighbors or nearest points, found "
            f"{type(interpolator).__name__}, which the live kernel does not know."
        )
    hands = [SIDES.index(side) for side in chain_sides(chain)]
    return ControlMap(
        points=np.array(learned.centers_, order="C"),
        numbers=numbers,
        indices=indices,
        directions=np.array(learned.directions_, order="C"),
        lower=np.array(learned.lower_, order="C"),
        upper=np.array(learned.upper_, order="C"),
        columns=skeleton.columns(chain_joints(chain)) - 6,
        hands=np.array(hands, dtype=np.int64),
        link=link,
        need=np.array(need, dtype=np.int64),
    )

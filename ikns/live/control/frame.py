"""One live frame, from markers to the control signal, in one compiled call."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ikns._kernels.body.control_frame import control_frame, recorded_signals
from ikns._kernels.body.frame_constants import (
    FrameConstants,
    IntentNumbers,
    pack_constants,
)
from ikns._kernels.body.intent_signal import new_hand_memory
from ikns._kernels.body.uncertainty import WIDTH, Segments, new_marker_memory
from ikns._kernels.voronoi.diagram import INSIDE_HULL, OUTSIDE_HULL, new_work
from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike, as_chain, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.control.frame_result import ControlFrame
from ikns.live.control.intent import intent_numbers
from ikns.live.control.paper import end_paths, numbers_of_map
from ikns.motion.marker_ik.joint_speed import joint_speeds
from ikns.motion.marker_ik.kernel import KernelSolver
from ikns.motion.marker_ik.visibility import joint_segments, sight_needs
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.readout import Readout

#: Largest standard deviation of c with which the finger moves: c is then within 0.05
#: of what all markers would show nineteen times in twenty.
MAX_UNCERTAINTY = 0.025


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
        See :class:`ikns.Chain`.
    readout : Readout, optional
        Of this skeleton and chain: what reads c instead of the map, by a second
        compiled call. ``"paper"`` changes nothing; with ``"intent"`` `inside` says
        where natural movement was taught. ``"proximal"`` compiles a kernel of its own
        here, some seconds at its first use on a machine.
    max_uncertainty : float, optional
        c is NaN where its standard deviation is larger. A segment may then be hidden as
        long as c does not need it. None: no limit, and c is NaN whenever a segment of
        the chain is not visible, as in sessions recorded without a limit.

    Raises
    ------
    InvalidInput
        When the map is for other joints or the readout for another chain, or the
        kernels do not support one of them.

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
        chain: ChainLike,
        *,
        readout: Readout | None = None,
        max_uncertainty: float | None = MAX_UNCERTAINTY,
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
        if readout is not None and as_chain(readout.chain) != as_chain(chain):
            raise InvalidInput(
                f"expected a readout of {chain}, found one of {readout.chain}."
            )
        self.skeleton, self.null_space_map, self.chain = skeleton, null_space_map, chain
        self.max_uncertainty = max_uncertainty
        self._ik = KernelSolver(skeleton)
        paths, _ = end_paths(skeleton, chain)
        intent = IntentNumbers(skeleton.hand_paths, np.empty(0), np.empty((0, 0)))
        if readout is not None and readout.method == "intent":
            intent = intent_numbers(skeleton, readout)
        self._proximal = None
        if readout is not None and readout.method == "proximal":
            # Other methods do not wait until this is compiled.
            from ikns._kernels.body.proximal_frame import proximal_frame
            from ikns.live.control.proximal import proximal_numbers

            self._proximal = proximal_frame, proximal_numbers(skeleton, readout)
        of_marker, of_joint = joint_segments(skeleton)
        self.sight_needs = sight_needs(skeleton, chain)
        control_map = numbers_of_map(
            skeleton, null_space_map, chain, self.sight_needs.values()
        )
        of_marker[control_map.link < 0] = -1
        self._segments = Segments(
            of_marker, of_joint, joint_speeds(skeleton), int(of_joint.max()) + 1
        )
        constants = FrameConstants(
            paths,
            self._ik.gate,
            control_map,
            intent,
            self._segments,
        )
        self._constants = pack_constants(constants)
        self._seen_before = _new_memory(len(of_marker))
        indices = control_map.indices
        self._cavity = new_work(indices) if len(indices) else np.empty(0)
        ends = max(2, len(paths.ends))  # or as much as intent takes
        self._rotation = np.empty((1, ends, 3, 3))
        self._position = np.empty((1, ends, 3))
        self._weights = np.empty(len(null_space_map.centers_))
        self._markers = np.empty((len(skeleton.marker_set.markers), 3))
        self._memory = self._ik.new_memory()
        self._start = self._memory[-len(skeleton.neutral()) :]
        self.reset()
        if self._proximal is not None:
            self._ik.work[:] = 0.0  # no marker is seen: compile, and do nothing
            self._read_proximal(
                self._seen_before, self._q, np.zeros(3), np.zeros(1), np.zeros(1)
            )

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
        self._start[...] = self._q

    def solve(self, markers: ArrayLike, dt: float = 0.01) -> ControlFrame:
        """Solve the next frame.

        Parameters
        ----------
        markers : (M, 3) array
            Positions in the world (m) in the order of the skeleton's marker set; NaN
            where not seen.
        dt : float
            Time since the frame before, s; of a hidden marker less is known the longer
            it is hidden. What is not above 0 and finite counts as 0.
        """
        seen = np.asarray(markers, dtype=np.float64)
        if seen.shape != self._markers.shape:
            raise InvalidInput(
                f"expected markers {self._markers.shape}, found {seen.shape}."
            )
        self._markers[...] = seen
        place, d = np.empty(3), self.null_space_map.directions_.shape[1]
        c, uncertainty = np.empty(d), np.empty(d)
        residual, worst, apart, iterations, converged, seen_all, status = control_frame(
            *self._ik.packed,
            *self._constants,
            self._markers,
            float(dt),
            self._lost,
            self._memory,
            self._seen_before,
            self._q,
            self._ik.work,
            self._cavity,
            self._rotation,
            self._position,
            self._weights,
            place,
            c,
            uncertainty,
        )
        if self._proximal is not None:
            inside = self._read_proximal(
                self._seen_before, self._q, place, c, uncertainty
            )
            status = INSIDE_HULL if inside else OUTSIDE_HULL
        self._lost = self._lost and not math.isfinite(residual)
        self._start[...] = self._q
        limit = self.max_uncertainty
        # A deviation that is NaN is not certain either.
        certain = [
            seen_all if limit is None else deviation <= limit
            for deviation in uncertainty.tolist()
        ]
        for k, known in enumerate(certain):
            if not known:
                c[k] = np.nan
        return ControlFrame(
            c,
            self._q.copy(),
            place,
            seen_all,
            certain[0] and status == INSIDE_HULL,
            residual,
            worst,
            apart,
            iterations,
            converged,
            uncertainty,
        )

    def read(
        self, q: Array, markers: Array, time: Array, believed: Mask
    ) -> tuple[Array, Array]:
        """Read the signals off poses that are solved already, in order of time.

        Parameters
        ----------
        q : (T, nq) array
        markers : (T, M, 3) array
            As for :meth:`solve`, one by one.
        time : (T,) array
            s.
        believed : (T,) boolean array
            Whether the markers of the chain are trusted; other frames have no effect.

        Returns
        -------
        c, uncertainty : (T, d) arrays
            c has no limit here, and is NaN only as the map's is, and without a marker.
        """
        seen = np.ascontiguousarray(markers, dtype=np.float64)
        poses, steps = np.array(q, dtype=np.float64), np.diff(time, prepend=time[0])
        c, uncertainty = np.empty((2, len(q), self.null_space_map.directions_.shape[1]))
        trusted = np.ascontiguousarray(believed)
        memory = _new_memory(seen.shape[1])
        # Proximal is read off what the call for a frame leaves in its work memory.
        size = max(1, len(poses)) if self._proximal is None else 1
        for i in range(0, len(poses), size):
            rows = slice(i, i + size)
            recorded_signals(
                *self._ik.packed,
                *self._constants,
                seen[rows],
                steps[rows],
                trusted[rows],
                memory,
                poses[rows],
                self._ik.work,
                self._cavity,
                self._rotation,
                self._position,
                self._weights,
                np.empty(3),
                c[rows],
                uncertainty[rows],
            )
            if self._proximal is not None:
                place = self.skeleton.chain_ends(poses[i], self.chain)[0].mean(axis=0)
                self._read_proximal(memory, poses[i], place, c[i], uncertainty[i])
        return c, uncertainty

    def _read_proximal(
        self, memory: Array, q: Array, place: Array, c: Array, uncertainty: Array
    ) -> bool:
        """Write c of proximal for the frame last solved; return whether inside."""
        assert self._proximal is not None
        kernel, numbers = self._proximal
        return bool(
            kernel(
                *self._ik.packed,
                self._segments,
                numbers,
                memory[: len(self._markers)],
                q,
                self._ik.work,
                place,
                c,
                uncertainty,
            )
        )


def _new_memory(n_markers: int) -> Array:
    """Return what is known before the first frame: of markers, and of the hand."""
    return np.vstack([new_marker_memory(n_markers), new_hand_memory(WIDTH)])

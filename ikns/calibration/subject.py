"""A calibrated person: body, markers and null-space map, in memory and on disk.

A subject folder is plain text: ``skeleton.urdf``, ``markers.toml``, ``map.json`` and
``calibration.json``, the last two with a format version; ``proximal.json`` and
``intent.json`` where these methods were learned, and ``samples.csv`` where the still
samples of the calibration are known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.body.chain_files import shipped_chains
from ikns.body.chains import (
    ChainLike,
    as_chain,
    chain_joints,
    no_swivel,
    whole_arms,
)
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton, check_chain
from ikns.body.skeleton.model import read_urdf
from ikns.calibration.subject_files import (
    FILES,
    OTHERS,
    SAMPLES,
    check_subject_folder,
)
from ikns.calibration.subject_tables import (
    COLUMNS,
    FORMAT,
    chain_of_map,
    read_json,
    read_readout,
    read_samples,
    write_json,
    write_readout,
)
from ikns.errors import FileError, IknsError, InvalidInput, naming
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.readout import METHODS, Method, Readout
from ikns.output.folder import check_output_folder, output_folder


@dataclass(frozen=True, eq=False)
class Subject:
    """The result of a person's calibration.

    Parameters
    ----------
    skeleton : Skeleton
        The scaled body with its markers.
    null_space_map : NullSpaceMap
        Fitted, or from a file.
    chain : str or Chain
        Joints of the map, see :class:`ikns.Chain`.
    report : dict
        How the calibration went: strings, finite numbers, None, lists and dicts.
    motions : tuple of Motion
        The explorations as tracked. They are not saved.
    samples : (N, 4) array, optional
        Still samples to draw: x, y, z of the hand, m in the thorax frame, and the PCA
        point that each counts to, from 1; 0 where it was discarded.

    Examples
    --------
    >>> import ikns
    >>> from tempfile import TemporaryDirectory
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, quick=True
    ... )
    >>> subject = ikns.calibrate(run.static.recording, [run.points.recording])
    >>> with TemporaryDirectory() as folder:
    ...     subject.save(f"{folder}/subject")
    ...     Subject.load(f"{folder}/subject").chain
    'right_arm'
    """

    skeleton: Skeleton
    null_space_map: NullSpaceMap
    chain: ChainLike
    report: dict[str, Any]
    motions: tuple[Motion, ...] = field(default=(), repr=False)
    samples: Array | None = field(default=None, repr=False)
    readouts: dict[str, Readout] = field(default_factory=dict, repr=False)

    @property
    def measured(self) -> bool:
        """Whether the body comes from a static trial, not from stature alone."""
        static = self.report.get("static")
        return not isinstance(static, dict) or static.get("source", "") is not None

    @property
    def methods(self) -> list[str]:
        """Methods available for this subject: ``paper`` and any others."""
        return ["paper", *(method for method in OTHERS if method in self.readouts)]

    def readout(self, method: Method = "paper") -> Readout:
        """Return a method's map and the coordinate that it uses.

        Raises
        ------
        InvalidInput
            When there is no such method, or this subject was calibrated without it.
        """
        if method == "paper":
            return Readout("paper", self.chain, self.null_space_map)
        if method not in METHODS:
            raise InvalidInput(
                f"expected a method of {', '.join(METHODS)}, found '{method}'."
            )
        if method not in self.readouts:
            if not whole_arms(self.chain):
                raise InvalidInput(no_swivel(self.chain))
            known = self.methods
            raise InvalidInput(
                f"this subject has the method{'s' * (len(known) > 1)} "
                f"{' and '.join(known)} only; calibrate one arm with one degree of "
                f"freedom (--n-dof 1) to use {method}."
            )
        return self.readouts[method]

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Write the subject folder, completely or not at all.

        Parameters
        ----------
        folder : str or Path
            Created when missing; its parent must exist.
        force : bool
            Whether to replace a subject folder that exists.

        Raises
        ------
        InvalidInput
            When the folder exists and may not be replaced.
        FileError
            When it cannot be written.
        """
        check_output_folder(folder, FILES, force=force)
        with output_folder(folder) as part:
            self.skeleton.write(part / "skeleton.urdf")
            self.skeleton.marker_set.write(part / "markers.toml")
            write_json(part / "map.json", self._map())
            write_json(part / "calibration.json", {"format": FORMAT} | self.report)
            for method, readout in self.readouts.items():
                write_readout(part / f"{method}.json", readout)
            if self.samples is not None:
                # A tenth of a millimeter is finer than cameras see.
                np.savetxt(
                    part / SAMPLES,
                    self.samples,
                    fmt=["%.4f"] * 3 + ["%d"],
                    delimiter=",",
                    header=COLUMNS,
                    comments="",
                )

    @classmethod
    def load(cls, folder: str | Path) -> Subject:
        """Read a subject folder.

        Raises
        ------
        FileError
            When a file is missing, damaged or of an unknown version.
        MarkerMismatch
            When a marker sits on a link that the URDF does not have.
        """
        place = check_subject_folder(folder)
        urdf = place / "skeleton.urdf"
        worn = MarkerSet.load(place / "markers.toml")
        text = read_urdf(urdf)
        with naming(str(urdf)):
            skeleton = Skeleton(text, worn)
        report = read_json(place / "calibration.json")
        del report["format"]
        table = read_json(place / "map.json")
        try:
            chain = chain_of_map(table)
            check_chain(skeleton, chain)
            if tuple(table["joints"]) != chain_joints(chain):
                raise InvalidInput(
                    f"expected the joints {', '.join(chain_joints(chain))}, found "
                    f"{', '.join(map(str, table['joints']))}."
                )
            points = table["points"]
            learned = NullSpaceMap.from_arrays(
                *(
                    [point[key] for point in points]
                    for key in ("center_m", "directions", "lower_rad", "upper_rad")
                ),
                counts=[int(point["samples"]) for point in points],
                outside=table["outside"],
                # Folders from before there was a choice do not say it.
                interpolation=table.get("interpolation", "natural"),
            )
            radius = table["radius_m"]
            learned.radius_ = None if radius is None else float(radius)
            if all("mean_rad" in point for point in points):
                means = np.array([point["mean_rad"] for point in points], dtype=float)
                if means.shape != learned.directions_[:, 0].shape:
                    raise InvalidInput("a mean posture needs one entry per joint.")
                learned.cluster_means_ = means
            if learned.directions_.shape[2] != len(table["joints"]):
                raise InvalidInput("a direction needs one entry per joint.")
        except (LookupError, TypeError, ValueError) as error:
            fault = f"{error}" if isinstance(error, IknsError) else f"({error!r})."
            raise FileError(
                f"{place / 'map.json'}: cannot be read as a null-space map: {fault}"
            ) from None
        samples = read_samples(place / SAMPLES, n_points=len(learned.centers_))
        readouts = {
            method: read_readout(place / f"{method}.json", method, chain)
            for method in OTHERS
            if (place / f"{method}.json").exists()
        }
        return cls(skeleton, learned, chain, report, samples=samples, readouts=readouts)

    @property
    def gate(self) -> dict[str, float]:
        """Gate of the calibration, as :func:`ikns.nullspace.map.still_mask` takes it.

        ``max_hand_speed``, m/s, and ``min_duration``, s; the defaults where the report
        does not say.

        Raises
        ------
        InvalidInput
            When the values in the report are invalid.
        """
        settings = self.report.get("settings", {})
        try:
            gate = {
                "max_hand_speed": float(settings.get("max_hand_speed_m_s", 0.05)),
                "min_duration": float(settings.get("min_rest_s", 0.0)),
            }
        except (AttributeError, TypeError, ValueError):
            gate = {"max_hand_speed": np.nan}
        if not (
            0 < gate["max_hand_speed"] < np.inf and 0 <= gate["min_duration"] < np.inf
        ):
            raise InvalidInput(
                "expected max_hand_speed_m_s above 0 and min_rest_s of at least 0 in "
                f"the settings of the calibration's report, found {settings}."
            )
        return gate

    def _map(self) -> dict[str, Any]:
        learned = self.null_space_map
        # Nothing else in the folder says what a custom chain is.
        known_chain = str(self.chain) in shipped_chains()
        own = {} if known_chain else as_chain(self.chain).table()
        # A map that was not fitted has no postures.
        known = getattr(learned, "cluster_means_", None)
        means: list[dict[str, Any]] = [{} for _ in learned.centers_]
        if known is not None:
            means = [{"mean_rad": mean.tolist()} for mean in known]
        return {
            "format": FORMAT,
            "chain": str(self.chain),
            "joints": list(chain_joints(self.chain)),
            **own,
            "outside": learned.outside,
            "interpolation": learned.interpolation,
            "radius_m": learned.radius_,
            "points": [
                {
                    "center_m": center.tolist(),
                    "directions": directions.tolist(),
                    "lower_rad": lower.tolist(),
                    "upper_rad": upper.tolist(),
                    "samples": int(count),
                }
                | mean
                for center, directions, lower, upper, count, mean in zip(
                    learned.centers_,
                    learned.directions_,
                    learned.lower_,
                    learned.upper_,
                    learned.counts_,
                    means,
                    strict=True,
                )
            ],
        }

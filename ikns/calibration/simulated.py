"""Whether a calibration is known to be simulated, and how near it is to the truth."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.nullspace.map import still_mask


def is_simulated(
    subject: Subject, folder: Path, recordings: Sequence[Path] = ()
) -> bool:
    """Whether the subject or one of the recordings is known to be simulated.

    The calibration's report may say so, the ``summary.json`` of ``ikns demo`` next to
    the folder that the subject was read from, or the ``truth.json`` next to a simulated
    recording.
    """
    places = [folder.absolute().parent / "summary.json"]
    places += [path.absolute().parent / "truth.json" for path in recordings]
    return bool(subject.report.get("simulated")) or any(map(_says_simulated, places))


def played_files(source: str) -> list[Path]:
    """Return the file that a live source plays, if it plays one.

    >>> [path.name for path in played_files("replay:walk.c3d?speed=2")]
    ['walk.c3d']
    """
    scheme, _, rest = source.partition(":")
    return [Path(rest.partition("?")[0])] if scheme == "replay" else []


def _says_simulated(path: Path) -> bool:
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(about, dict) and about.get("simulated") is True


class SwivelSamples(NamedTuple):
    """The still samples that a map was learned from, with the true swivel."""

    hand: Array  # (N, 3) m in the thorax frame
    labels: Indices  # (N,) PCA point, -1 for none
    c: Array  # (N,) control signal, not clipped
    swivel: Array  # (N,) true elbow swivel, rad
    correlations: list[float]  # of c and swivel at each of P points


def swivel_samples(subject: Subject, swivel: ArrayLike) -> SwivelSamples:
    """Compare c with the true swivel on the still samples of a calibration.

    The subject was just calibrated from one exploration of T frames, with one degree of
    freedom; the true swivel (T,) of each is in rad, NaN where it has none.
    """
    true = np.asarray(swivel, dtype=np.float64)
    if len(subject.motions) != 1 or true.shape != subject.motions[0].time.shape:
        raise InvalidInput(
            f"expected a subject with one exploration of {true.size} frames, found "
            f"{[len(motion.time) for motion in subject.motions]}."
        )
    motion, learned = subject.motions[0], subject.null_space_map
    still = still_mask(motion, subject.chain)
    hand, true = motion.task_position(subject.chain)[still], true[still]
    c = learned.control_signal(motion.chain_angles(subject.chain)[still], hand)
    correlations = []
    for k in range(len(learned.centers_)):
        own = (learned.labels_ == k) & np.isfinite(true) & np.isfinite(c)
        correlations.append(float(np.corrcoef(c[own], true[own])[0, 1]))
    return SwivelSamples(hand, learned.labels_, c, true, correlations)

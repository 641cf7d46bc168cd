"""One comparison for several tasks, chains and shoulder coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

from ikns.analysis.compare.from_motion import compare_motion
from ikns.analysis.compare.samples import NullSpaceComparison
from ikns.body.skeleton import Skeleton
from ikns.errors import NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap

__all__ = ["Combinations", "compare_combinations"]


class Combinations(NamedTuple):
    """Comparisons by (chain, task, coordinates), and chains that have none.

    Parameters
    ----------
    found : dict
        In the order of chains, then tasks, then coordinates.
    left_out : dict
        Why a chain could not be compared, by its name.
    """

    found: dict[tuple[str, str, str], NullSpaceComparison]
    left_out: dict[str, str]


def compare_combinations(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    motion: Motion,
    *,
    chain: str = "right_arm",
    chains: Sequence[str] = (),
    tasks: Sequence[Literal["pose", "position"]] = ("pose", "position"),
    coordinates: Sequence[str] = ("internal",),
    **options: Any,
) -> Combinations:
    """Repeat :func:`ikns.analysis.compare.compare_motion` in every combination.

    Parameters
    ----------
    learned, skeleton, motion
        As :func:`compare_motion` takes them.
    chain : str
        Joints of the map.
    chains : sequence of str
        Chains to analyze, of the same hands. Default: that of the map.
    tasks, coordinates : sequence of str
        See :func:`compare_motion`.
    **options
        Of :func:`compare_motion`.

    Returns
    -------
    Combinations

    Raises
    ------
    InvalidInput
        As :func:`compare_motion`.
    NotEnoughData
        When the map's own chain cannot be compared; others are left out instead.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, quick=True
    ... )
    >>> body = run.subject.skeleton
    >>> motion = run.points.truth
    >>> learned = ikns.NullSpaceMap(10).fit(*ikns.null_space_samples(motion))
    >>> compared = compare_combinations(learned, body, motion, resamples=0)
    >>> [(task, found.null_dim) for (_, task, _), found in compared.found.items()]
    [('pose', 1), ('position', 4)]
    """
    found: dict[tuple[str, str, str], NullSpaceComparison] = {}
    left_out: dict[str, str] = {}
    for analyzed in chains or (chain,):
        try:
            for task in tasks:
                for name in coordinates:
                    found[analyzed, task, name] = compare_motion(
                        learned,
                        skeleton,
                        motion,
                        chain=chain,
                        analyzed=analyzed,
                        task=task,
                        coordinates=name,
                        **options,
                    )
        except NotEnoughData as error:
            if analyzed == chain:
                raise
            left_out[analyzed] = str(error)
    return Combinations(found, left_out)

"""One comparison for several tasks, chains and shoulder coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

from ikns.analysis.compare.from_motion import compare_motion
from ikns.analysis.compare.samples import NullSpaceComparison
from ikns.body.chains import ChainLike, as_chain
from ikns.body.skeleton import Skeleton
from ikns.errors import NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap


class Combinations(NamedTuple):
    """Comparisons by (chain, task, coordinates), and why chains have none, by name."""

    found: dict[tuple[str, str, str], NullSpaceComparison]
    left_out: dict[str, str]


def compare_combinations(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    motion: Motion,
    *,
    chain: ChainLike = "right_arm",
    chains: Sequence[ChainLike] = (),
    tasks: Sequence[Literal["pose", "position"]] = ("pose", "position"),
    coordinates: Sequence[str] = ("internal",),
    progress: Callable[[int, int], None] = lambda done, total: None,
    **options: Any,
) -> Combinations:
    """Repeat :func:`ikns.analysis.compare.compare_motion` in every combination.

    Parameters
    ----------
    learned, skeleton, motion, chain
        As :func:`compare_motion` takes them.
    chains : sequence of str
        Chains to analyze, of the same hands. Default: that of the map.
    tasks, coordinates : sequence of str
    progress : callable
        Called with (combinations done, combinations in total).
    **options
        Of :func:`compare_motion`.

    Raises
    ------
    InvalidInput
        As :func:`compare_motion`.
    NotEnoughData
        When the map's own chain cannot be compared; others are left out instead.
    """
    found: dict[tuple[str, str, str], NullSpaceComparison] = {}
    left_out: dict[str, str] = {}
    each = len(tasks) * len(coordinates)
    total = each * len(chains or (chain,))
    for k, analyzed in enumerate(chains or (chain,)):
        progress(k * each, total)
        try:
            for task in tasks:
                for name in coordinates:
                    found[str(analyzed), task, name] = compare_motion(
                        learned,
                        skeleton,
                        motion,
                        chain=chain,
                        analyzed=analyzed,
                        task=task,
                        coordinates=name,
                        **options,
                    )
                    progress(len(found) + each * len(left_out), total)
        except NotEnoughData as error:
            if as_chain(analyzed) == as_chain(chain):
                raise
            left_out[str(analyzed)] = str(error)
    return Combinations(found, left_out)

"""Clusters on a forearm whose skin follows pronation in part only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ikns.body.chains import SIDES
from ikns.body.marker_set import Marker, MarkerSet

#: So many markers show how their segment lies.
CLUSTER = 3
#: A marker whose place varies by more, standard deviation of all directions together,
#: m, is on no landmark: those of the shipped sets have 8 to 26 mm, clusters 49 or more.
ANYWHERE = 0.03
#: Weight of a cluster that sits on bone beside one on skin, as in `ue_adl`.
_ON_BONE = 10.0


def turning_labels(worn: MarkerSet) -> tuple[str, ...]:
    """Labels on forearms whose markers should turn freely, and do not.

    That is where every marker worn in movement is one of a cluster, three or more, and
    three or more on the hand show how far the forearm is turned. In seven people the
    skin followed 0.29 to 0.57 of pronation, in one of their arms 0.72
    (``urdf/markers/ue_adl.toml``).

    Examples
    --------
    >>> shipped = MarkerSet.load("ue_adl")
    >>> turning_labels(shipped)
    ()
    >>> fixed = replace(
    ...     shipped,
    ...     markers=tuple(replace(m, free_turn=False) for m in shipped.markers),
    ... )
    >>> turning_labels(fixed)[:4]
    ('RLAR1', 'RLAR2', 'RLAR3', 'RLAR4')
    """
    found: tuple[str, ...] = ()
    for side in SIDES:
        skin = _tracked(worn, f"{side}_forearm")
        hand = [m for m in _tracked(worn, f"{side}_hand") if m.weight >= 1]
        if (
            min(len(skin), len(hand)) >= CLUSTER
            and all(np.linalg.norm(m.placement_sd) > ANYWHERE for m in skin)
            and not any(m.free_turn for m in skin)
        ):
            found += tuple(m.label for m in skin)
    return found


def with_free_turn(worn: MarkerSet, labels: tuple[str, ...]) -> MarkerSet:
    """Return the set with these markers turning freely about their joint."""
    markers = tuple(
        replace(m, free_turn=True) if m.label in labels else m for m in worn.markers
    )
    return replace(worn, markers=markers)


def with_firm_hands(worn: MarkerSet, labels: tuple[str, ...]) -> MarkerSet:
    """Return the set with more weight on the hands next to forearms with these labels.

    Only the hand then shows how far its forearm is turned, and a cluster on it sits on
    bone. In `benchmarks/own_sets.py` the tracked hand is 4 instead of 18 deg off.
    """
    links = {m.link for m in worn.markers if m.label in labels}
    hands = {link.replace("_forearm", "_hand") for link in links}
    return replace(
        worn,
        markers=tuple(
            replace(m, weight=_ON_BONE)
            if m.link in hands and np.linalg.norm(m.placement_sd) > ANYWHERE
            else m
            for m in worn.markers
        ),
    )


def _tracked(worn: MarkerSet, link: str) -> list[Marker]:
    return [
        m for m in worn.markers if m.link == link and not m.static_only and m.weight > 0
    ]

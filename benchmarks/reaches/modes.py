"""The control signals that are compared."""

from collections.abc import Callable

import numpy as np

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.live.control import RateControl, reach_gain
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap

POSITION, SWIVEL = "position mode (paper)", "elbow swivel of the fitted body"
DEFAULT = "rate, Jacobian, carry, travel"
#: What differs from the defaults: projector, metric, carry, travel, tau.
BARE = {"carry": 0.0, "travel": np.inf}
MODES: dict[str, dict[str, object]] = {
    "rate, learned, bare": {"learned": True, **BARE},
    "rate, Jacobian, bare": BARE,
    "rate, Jacobian, bare, expected motion as metric": {"expected": True, **BARE},
    "rate, Jacobian, travel": {"carry": 0.0},
    "rate, Jacobian, carry": {"travel": np.inf},
    "rate, learned, carry, travel": {"learned": True},
    DEFAULT: {},
    "rate, Jacobian, half the carry, travel": {"carry": 0.5},
    "rate, Jacobian, twice the carry, travel": {"carry": 2.0},
    "rate, Jacobian, calibrated carry, travel": {"calibrated": True},
    "rate, Jacobian, carry, tau 5 s": {"travel": np.inf, "tau": 5.0},
}


def controls(
    body: Skeleton, learned: NullSpaceMap, chain: str, calm: list[Motion]
) -> dict[str, Callable[..., RateControl]]:
    """Rate modes of one person, set with reaches at which nothing was meant."""
    joints = [motion.chain_velocities(chain) for motion in calm]
    speeds = [motion.hand_speed(chain) for motion in calm]
    v = np.concatenate([j[s > 0.05] for j, s in zip(joints, speeds, strict=True)])
    spread = v.T @ v / len(v)
    n = len(chain_joints(chain))
    expected = np.linalg.inv(spread + 1e-3 * np.trace(spread) / n * np.eye(n))
    made = {}
    for name, given in MODES.items():
        settings = dict(given)
        skeleton = None if settings.pop("learned", False) else body
        if settings.pop("expected", False):
            settings["metric"] = expected
        if settings.pop("calibrated", False):
            # Of several motions the mean, so that each task counts alike.
            bare = RateControl(learned, skeleton, chain)
            settings["carry"] = np.mean([reach_gain(bare, m) for m in calm], axis=0)
        made[name] = lambda limits, s=skeleton, k=settings: RateControl(
            learned, s, chain, limits=limits, **k
        )
    return made


def tracks(control: RateControl, motion: Motion, known: dict) -> np.ndarray:
    """As `control.track`, but with rates that modes share found once."""
    metric = None if control.metric is None else control.metric.tobytes()
    key = id(motion), control.skeleton is None, metric
    find = control.rate
    if key in known:
        found = iter(known[key])
        control.rate = lambda *sample: next(found)
    else:
        known[key] = kept = []
        control.rate = lambda *sample: kept.append(find(*sample)) or kept[-1]
    return control.track(motion)

"""What one trial of each movement of real people supports (UE_ADL)."""

import itertools
from pathlib import Path

import numpy as np

from ikns.analysis.ucm import (
    across_trials,
    confidence_interval,
    movement,
    surrogate_test,
    within_trial,
)
from ikns.body.chains import SIDES, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.errors import NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.map import still_mask
from ikns.numerics.subspace import null_projector
from ikns.recording.files import read
from ikns.recording.recording import Recording

TASKS = {"F": "reach forward", "A": "reach across", "D": "drink", "C": "comb hair"}
DEG2 = np.degrees(1.0) ** 2


def self_motion_index(skeleton: Skeleton, motion: Motion, chain: str) -> dict:
    """Joint velocity along the null space over that across it, per joint (log / 2)."""
    cut = movement(motion.time, motion.hand_speed(chain))
    velocity = motion.chain_velocities(chain)[cut]
    J = skeleton.chain_jacobian(motion.angles[cut], chain, task="position")
    k, n = J.shape[-2:]
    known = np.isfinite(velocity).all(axis=1)
    outer = velocity[known][:, :, None] * velocity[known][:, None, :]
    # Turning joints around by signs s only changes which products count how.
    products = np.sum(null_projector(J[known]) * outer, axis=0)
    whole = float(np.sum(velocity[known] ** 2))
    signs = np.array([(1, *s) for s in itertools.product((1, -1), repeat=n - 1)])
    null = np.einsum("si,ij,sj->s", signs, products, signs)
    index = np.log((null / (n - k)) / ((whole - null) / k)) / 2
    return {
        "seconds": float(np.ptp(motion.time[cut])),
        "null_share": null[0] / whole,
        "index": index[0],
        "index_turned": index.mean(),
        "rank": int(np.sum(index >= index[0] - 1e-12)),
        "patterns": len(signs),
    }


def longest_rest(motion: Motion, chain: str) -> np.ndarray:
    """Longest time with the hand at rest, as which samples."""
    gate = still_mask(motion, chain, min_duration=0.5)
    edges = np.flatnonzero(np.diff(np.r_[False, gate, False])).reshape(-1, 2)
    rows = np.zeros(len(gate), dtype=bool)
    if len(edges):
        rows[slice(*edges[np.argmax(edges[:, 1] - edges[:, 0])])] = True
    return rows


def noise_alone(
    skeleton: Skeleton,
    motion: Motion,
    recording: Recording,
    rows: np.ndarray,
    seed: int,
) -> Motion:
    """Track a body that does not move, with the camera noise of these frames.

    White noise of a marker makes second differences of sqrt(6) times its size.
    """
    worn = skeleton.marker_set
    seen = worn.pick(recording.labels, recording.markers)[rows]
    sd = np.nan_to_num(np.nanstd(np.diff(seen, 2, axis=0), axis=0) / np.sqrt(6))
    body = motion.q[np.flatnonzero(rows)[rows.sum() // 2]]
    noise = sd * np.random.default_rng(seed).normal(size=seen.shape)
    markers = skeleton.markers_in_world(body) + noise
    stood = Recording(recording.time[rows], markers, worn.labels, "noise alone")
    return MarkerIK(skeleton).track(stood)


def rest_row(skeleton, motion, recording, chain, *, seed, n_surrogates) -> dict:
    """Variance over the longest rest, and that of noise alone."""
    rows = longest_rest(motion, chain)
    if rows.sum() <= len(chain_joints(chain)):
        return {"samples": int(rows.sum())}
    split = within_trial(skeleton, motion, rows, chain=chain)
    test = surrogate_test(split, by="shift", n_surrogates=n_surrogates, seed=seed)
    interval = confidence_interval(split, method="bootstrap", seed=seed)
    noise = noise_alone(skeleton, motion, recording, rows, seed)
    floor = within_trial(skeleton, noise, np.ones(rows.sum(), bool), chain=chain)
    return {
        "samples": int(rows.sum()),
        "v_ucm_deg2": DEG2 * split.v_ucm,
        "v_ort_deg2": DEG2 * split.v_ort,
        "noise_v_ucm_deg2": DEG2 * floor.v_ucm,
        "noise_v_ort_deg2": DEG2 * floor.v_ort,
        "delta_vz": split.delta_vz_corrected,
        "interval": [
            end - split.delta_vz + split.delta_vz_corrected
            for end in (interval.low, interval.high)
        ],
        "noise_delta_vz": floor.delta_vz_corrected,
        "p": test.p,
    }


def real_people(folder: Path, *, quick: bool, seed: int) -> tuple[list[dict], str]:
    """One row a recording, and what the library says to variance over trials."""
    rows, sentence = [], ""
    for name in ("ADL001", "ADL005"):
        static = read(folder / name / f"{name}_static.csv")
        # One of the two static trials lasts 0.41 s.
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3
        )
        for task, side in itertools.product(TASKS, SIDES):
            if quick and (task, side) not in (("F", "right"), ("C", "left")):
                continue
            recording = read(folder / name / f"{name}{task}{side[0].upper()}1.csv")
            chain = f"{side}_arm"
            motion = MarkerIK(skeleton).track(recording, chain=chain)
            try:
                across_trials(skeleton, [motion], chain=chain)
            except NotEnoughData as error:
                sentence = str(error)
            rows.append(
                {"person": name, "task": TASKS[task], "side": side}
                | self_motion_index(skeleton, motion, chain)
                | {
                    "rest": rest_row(
                        skeleton,
                        motion,
                        recording,
                        chain,
                        seed=seed,
                        n_surrogates=199 if quick else 999,
                    )
                }
            )
    return rows, sentence

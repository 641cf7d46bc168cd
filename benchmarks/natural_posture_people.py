r"""Natural posture of the people of UE_ADL: mean and covariance, as a small TOML file.

For each arm the hinge swivel of all moving frames (reaches forward and across,
drinking, combing) is fitted with a quadratic in the wrist center and the hand's
direction, by a ridge of 0.01 on all but the constant. Mean and covariance of these
coefficients over the arms are the population; no recording is copied.

    python benchmarks/natural_posture_people.py \
        --out ikns/nullspace/natural_posture_people.toml
"""

import argparse
from pathlib import Path

import numpy as np
import tomli_w
from null_space.people import GATE, Arm, real_arms

from ikns.nullspace.hinge_swivel import hand_direction
from ikns.nullspace.posture_terms import (
    leverage_of,
    natural_terms,
    quadratic_terms,
    ridge,
    wrist_of,
)

Array = np.ndarray
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: Ridge of each arm's own fit, and the penalty that goes into the leverage.
RIDGE, PENALTY = 1e-2, 0.03
SOURCE = (
    "UE_ADLdatabase (MiaH-kin/UE_ADLdatabase d196e59, San Francisco State University), "
    "both arms of {people} people who reached forward and across, drank and combed"
)
LICENSE = "MIT; only means over people, no recording"


def moving(arm: Arm) -> tuple[Array, Array]:
    """Places (N, 6) and swivels (N,) rad of moving frames."""
    rows = [trial.known & (trial.speed >= GATE) for trial in arm.trials]
    wrist, swivel, angles = (
        np.concatenate([part[row] for part, row in zip(whole, rows, strict=True)])
        for whole in (
            [trial.wrist for trial in arm.trials],
            [trial.swivel for trial in arm.trials],
            [trial.angles for trial in arm.trials],
        )
    )
    direction = hand_direction(arm.skeleton, angles, arm.chain)
    return np.hstack([wrist, direction]), swivel


def own_fit(x: Array, swivel: Array) -> Array:
    """Coefficients of one arm, rad: (13,) of places (N, 6), (10,) of wrists (N, 3)."""
    return ridge(natural_terms(x), swivel, RIDGE)


def population(arms: list[Arm]) -> dict[str, object]:
    """Mean and covariance over arms, and where they moved."""
    found = [moving(arm) for arm in arms]
    rows = np.array([own_fit(x, s) for x, s in found])
    alone = [own_fit(wrist_of(x), s) for x, s in found]
    # Each arm counts alike, however long it was recorded.
    wrists = [wrist_of(x)[:: max(1, len(x) // 1000)] for x, _ in found]
    matrix, level = leverage_of(quadratic_terms(np.concatenate(wrists)), PENALTY)
    return {
        "mean_rad": rows.mean(axis=0),
        "covariance_rad2": np.cov(rows.T),
        "wrist_alone_rad": np.mean(alone, axis=0),
        "leverage": matrix,
        "taught_leverage": level,
        "arms": len(arms),
    }


def main() -> None:
    """Write the file, or print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--out", type=Path, help="TOML file to write")
    parser.add_argument("--quick", action="store_true", help="two people, not written")
    options = parser.parse_args()
    arms = real_arms(options.data / "ue_adl", people=2 if options.quick else None)
    table: dict[str, object] = {
        "format": 1,
        "made_by": "benchmarks/natural_posture_people.py",
        "source": SOURCE.format(people=len({arm.person for arm in arms})),
        "license": LICENSE,
        "terms": "1, x, y, z, x^2, y^2, z^2, xy, xz, yz of (wrist - middle) / unit; "
        "x, y, z of the unit vector from wrist to knuckle",
        "middle_m": [0.25, -0.15, 0.20],
        "unit_m": 0.2,
    }
    for name, value in population(arms).items():
        # Six digits are a microradian.
        table[name] = (
            np.round(value, 6).tolist() if isinstance(value, np.ndarray) else value
        )
    text = tomli_w.dumps(table)
    if options.out and not options.quick:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

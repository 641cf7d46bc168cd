r"""Natural posture of the people of UE_ADL: mean and covariance, as a small TOML file.

For each arm the hinge swivel of all moving frames (reaches forward and across,
drinking, combing) is fitted with a quadratic in the wrist center, by a ridge of 1e-3
on all but the constant. Mean and covariance of these coefficients over the arms
are the population; no recording is copied.

    python benchmarks/natural_posture_people.py \
        --out ikns/nullspace/natural_posture_people.toml
"""

import argparse
from pathlib import Path

import numpy as np
import tomli_w
from null_space.people import GATE, Arm, real_arms

from ikns.nullspace.natural_posture import leverage_of, quadratic_terms

Array = np.ndarray
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: Ridge of each arm's own fit, and the penalty that goes into the leverage.
RIDGE, PENALTY = 1e-3, 0.03
SOURCE = (
    "UE_ADLdatabase (MiaH-kin/UE_ADLdatabase d196e59, San Francisco State University), "
    "both arms of {people} people who reached forward and across, drank and combed"
)
LICENSE = "MIT; only means over people, no recording"


def moving(arm: Arm) -> tuple[Array, Array]:
    """Wrist centers and swivels of an arm's moving frames, (N, 3) m and (N,) rad."""
    rows = [trial.known & (trial.speed >= GATE) for trial in arm.trials]
    pairs = list(zip(arm.trials, rows, strict=True))
    return (
        np.concatenate([trial.wrist[row] for trial, row in pairs]),
        np.concatenate([trial.swivel[row] for trial, row in pairs]),
    )


def own_fit(wrist: Array, swivel: Array) -> Array:
    """Coefficients of one arm, (10,) rad."""
    phi = quadratic_terms(wrist)
    free = np.diag([0.0] + [RIDGE] * 9)
    n = len(phi)
    return np.linalg.solve(phi.T @ phi / n + free, phi.T @ swivel / n)


def population(arms: list[Arm]) -> dict[str, object]:
    """Mean and covariance over arms, and where they moved."""
    taught = [moving(arm) for arm in arms]
    rows = np.array([own_fit(*pair) for pair in taught])
    # Each arm counts alike, however long it was recorded.
    step = [max(1, len(w) // 1000) for w, _ in taught]
    places = np.concatenate([w[::s] for (w, _), s in zip(taught, step, strict=True)])
    matrix, level = leverage_of(quadratic_terms(places), PENALTY)
    return {
        "mean_rad": rows.mean(axis=0),
        "covariance_rad2": np.cov(rows.T),
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
        "terms": "1, x, y, z, x^2, y^2, z^2, xy, xz, yz of (wrist - middle) / unit",
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

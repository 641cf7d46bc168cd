"""Virtual people of another making: how they hold an arm, move, wish, and wear markers.

Bodies, movement, skin and noise share no code with the package (see
:mod:`null_space.virtual_arm`). The one thing taken from real people is how much the
elbow turns with the hand: ``ikns/simulation/posture_habits.toml`` is read as data, and
evaluated here. The population that the package ships to learners is therefore near the
mean of these people, as it is for the real ones it was made from; each person departs
from it by the spread between real arms, by a rough field that is no polynomial, and by
1.9 deg from rest to rest.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import multivariate_normal

from null_space.virtual_arm import (
    Arm,
    Walk,
    oriented,
    other_body,
    pose,
    posed,
    steadied,
    walk,
)

Array = np.ndarray
RATE = 50.0
_TABLE = Path(__file__).resolve().parents[2] / "ikns/simulation/posture_habits.toml"
#: Box of the held places, from the thorax's origin in lengths of the arm and m; how far
#: people hold the hand from its corners, m (4 to 6 cm were measured: 5 cm over three
#: axes are 3 cm an axis).
MIDDLE, HALF, OFF = np.array([0.56, -0.40, 0.18]), 0.13, 0.03
#: Unsteadiness of a held hand, m and rad, and its frequencies, Hz.
DRIFT, TILT, SLOW = 3e-3, np.radians(1.2), (0.05, 0.35)
#: Farthest place of the wrist from the shoulder, in lengths of the arm.
_BENT = 0.95
#: Draws of a hand until it can be held.
_TRIES = 30
#: Usual pronation, wrist flexion and deviation, and how far they go, rad.
USUAL = np.radians([45, -5, 0])
FOREARM = np.radians([[-40, -60, -25], [100, 60, 25]])
#: Standing, arms hanging, rad.
STANDING = np.radians([10, 3, 0, 12, 5, 2, 0])
#: Displacement of markers with the posture, rms, m: clusters and landmarks.
SKIN = {"UPA": 3e-3, "UPB": 3e-3, "UPC": 3e-3, "FRM": 3e-3, "SHO": 3e-3}
LANDMARK = 1e-3
#: Turning points of the elbow a second, and how far each is off the end meant, of half
#: the range.
SWEEPS, SHORT = 0.9, 0.05
#: A turn of the hand as for a glass that is emptied, and of the wrist, to either side.
TURNS = {"forearm": (0, np.radians(29.0)), "wrist": (1, np.radians(20.0))}


@dataclass(frozen=True)
class Virtual:
    """One person.

    Parameters
    ----------
    seed : int
    body : Person
        Of ``tests/other_body.py``.
    coefficients, waves, phases, rough, rest
        Of the natural posture: see :meth:`natural`.
    low, high : float
        Ends of what is meant, from the natural posture, rad: c is 0 and 1 there.
    lag : dict of str to float
        How much markers stay behind a turning bone: ``upper`` arm, ``fore`` arm.
    """

    seed: int
    body: other_body.Person
    coefficients: Array
    waves: Array
    phases: Array
    rough: float
    rest: float
    low: float
    high: float
    lag: dict[str, float]

    @property
    def arm(self) -> Arm:
        """The right arm."""
        return self.body.right

    @property
    def size(self) -> float:
        """Upper arm and forearm, m."""
        return float(
            np.linalg.norm(self.arm.offsets[3]) + np.linalg.norm(self.arm.offsets[5])
        )

    def natural(self, wrist: Array, axis: Array, *, rough: bool = True) -> Array:
        """Swivel (T,) at which this arm means nothing, rad; `rough` in movement."""
        z = np.hstack([(wrist - [0.25, -0.15, 0.20]) / 0.2, axis])
        i, j = np.triu_indices(6, 1)
        terms = np.hstack([np.ones((len(z), 1)), z, z**2, z[:, i] * z[:, j]])
        # Shoulders end where polynomials do not.
        swivel = np.clip(terms @ self.coefficients, -0.3, 2.2)
        if not rough:
            return swivel
        waves = np.cos(np.hstack([wrist, axis]) @ self.waves.T + self.phases)
        return swivel + self.rough * np.sqrt(2 / len(self.phases)) * waves.sum(axis=1)


def draw_virtual(seed: int, *, common: int = 0) -> Virtual:
    """Draw a person; `common` draws what other people's mean is off for all of them."""
    rng = np.random.default_rng([31, seed])
    table = tomllib.loads(_TABLE.read_text())
    mean, cov = np.array(table["mean_rad"]), np.array(table["covariance_rad2"])
    # Rounded, and from fewer arms than coefficients: a little of the bare diagonal.
    cov += 0.05 * (np.diag(np.diag(cov)) - cov)
    # Fourteen arms leave their mean uncertain.
    shared = np.random.default_rng([32, common])
    mean = shared.multivariate_normal(mean, cov / table["arms"])
    width = np.radians(rng.normal(70, 7))
    middle = np.radians(rng.normal(0, 4))
    scale = np.repeat([0.15, 0.5], 3)
    return Virtual(
        seed,
        other_body.draw_person(seed),
        rng.multivariate_normal(mean, cov),
        rng.normal(size=(32, 6)) / scale,
        rng.uniform(0, 2 * np.pi, 32),
        float(np.sqrt(table["residual_rad"] ** 2 - table["rest_rad"] ** 2)),
        table["rest_rad"],
        middle - width / 2,
        middle + width / 2,
        {"upper": rng.uniform(0.05, 0.2), "fore": rng.uniform(0.2, 0.5)},
    )


@dataclass(frozen=True)
class Rests:
    """Where an arm rests: P places.

    Parameters
    ----------
    wrist : (P, 3) array
        m.
    distal : (P, 3) array
        Pronation, wrist flexion and deviation, rad.
    off : (P,) array
        Scatter of the natural posture from rest to rest, rad.
    """

    wrist: Array
    distal: Array
    off: Array


def rests(person: Virtual, offsets: Array, rng: np.random.Generator) -> Rests:
    """Rests with the wrist at offsets (P, 3) m from the middle of the box.

    The hand is held as real hands are at the end of a reach to this place, as far as
    forearm and wrist turn.
    """
    wrist = MIDDLE * [person.size, person.size, 1] + offsets
    # As far as a bent arm reaches.
    way = wrist - person.arm.offsets[0]
    far = np.linalg.norm(way, axis=1, keepdims=True)
    way *= np.minimum(1, _BENT * person.size / far)
    wrist = person.arm.offsets[0] + way
    hand = _hands(way / person.size, rng)
    at = Rests(wrist, np.tile(USUAL, (len(wrist), 1)), np.zeros(len(wrist)))
    for _ in range(8):
        q = naturally(person, at, rough=False, rounds=2)
        distal = oriented(person.arm, q, hand)[:, 4:]
        at = Rests(wrist, np.clip(distal, *FOREARM), at.off)
    return Rests(wrist, at.distal, rng.normal(scale=person.rest, size=len(wrist)))


def _hands(place: Array, rng: np.random.Generator) -> Array:
    """Orientations (P, 3, 3) of real hands with the wrist at places (P, 3).

    Places count from the shoulder, in lengths of the arm.
    """
    table = tomllib.loads(_TABLE.read_text())
    middle, share = np.array(table["middle"]), np.array(table["share"])
    means, covs = np.array(table["pose_mean"]), np.array(table["pose_covariance"])
    found = []
    for w in place:
        near = [
            multivariate_normal(mean[6:9], cov[6:9, 6:9]).logpdf(w)
            for mean, cov in zip(means, covs, strict=True)
        ]
        weight = share * np.exp(np.array(near) - max(near))
        k = rng.choice(len(share), p=weight / weight.sum())
        gain = covs[k, 9:, 6:9] @ np.linalg.inv(covs[k, 6:9, 6:9])
        mean = means[k, 9:] + gain @ (w - means[k, 6:9])
        vector = rng.multivariate_normal(
            mean, covs[k, 9:, 9:] - gain @ covs[k, 6:9, 9:]
        )
        found.append(middle @ _turned(vector, np.linalg.norm(vector)))
    return np.array(found)


def box(rng: np.random.Generator) -> Array:
    """Offsets of the ten held places, as far from the ideal ones as people are."""
    share = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    ideal = HALF * np.vstack([share, [[0, 1, 0], [0, -1, 0]]])
    return ideal + rng.normal(scale=OFF, size=ideal.shape)


def naturally(
    person: Virtual, at: Rests, *, rough: bool = True, rounds: int = 6
) -> Array:
    """Postures (P, 7) at rests, with the natural swivel of place and hand."""
    q, swivel = None, np.full(len(at.off), 0.8)
    for _ in range(rounds):
        q = posed(person.arm, at.wrist, swivel, at.distal, q)
        here = pose(person.arm, q)
        swivel = person.natural(here.wrist, here.hand_axis, rough=rough) + at.off
    return posed(person.arm, at.wrist, swivel, at.distal, q)


def smooth(n: int) -> Array:
    """Minimum-jerk share of a movement, (n,)."""
    t = np.arange(1, n + 1) / n
    return t**3 * (10 - 15 * t + 6 * t * t)


def reaching(
    person: Virtual, at: Rests, order: Array, rest: float
) -> tuple[Array, Array]:
    """Postures (T, 7) that visit rests in an order, and which one is held (T,), or -1.

    Each rest lasts `rest` s. On the way the elbow is where it naturally is.
    """
    wrist, distal, off, held = [], [], [], []
    for k, (a, b) in enumerate(zip(np.r_[order[:1], order[:-1]], order, strict=True)):
        if k:
            far = np.linalg.norm(at.wrist[b] - at.wrist[a])
            share = smooth(round(RATE * (0.6 + 1.2 * far)))[:, None]
            for whole, part in ((at.wrist, wrist), (at.distal, distal)):
                part.append(whole[a] + share * (whole[b] - whole[a]))
            off.append(at.off[a] + share[:, 0] * (at.off[b] - at.off[a]))
            held.append(np.full(len(share), -1))
        n = round(RATE * rest)
        wrist.append(np.tile(at.wrist[b], (n, 1)))
        distal.append(np.tile(at.distal[b], (n, 1)))
        off.append(np.full(n, at.off[b]))
        held.append(np.full(n, b))
    whole = [np.concatenate(part) for part in (wrist, distal, off)]
    # Ten postures a second, and a spline through them.
    n = len(whole[2])
    some = np.unique(np.r_[np.arange(0, n, round(RATE / 10)), n - 1])
    found = naturally(person, Rests(*(part[some] for part in whole)))
    return CubicSpline(some, found)(np.arange(n)), np.concatenate(held)


def slow(n: int, width: int, rng: np.random.Generator) -> Array:
    """Slow wander (n, width) of unit variance: sines of low frequency."""
    t = np.arange(n)[:, None, None] / RATE
    hertz = rng.uniform(*SLOW, size=(width, 5))
    phase = rng.uniform(0, 2 * np.pi, (width, 5))
    return np.sqrt(2 / 5) * np.sin(2 * np.pi * hertz * t + phase).sum(axis=2)


def held(person: Virtual, at: Rests) -> Walk:
    """Walk the self-motion at rests, as far as this person explores.

    What is meant counts from the smooth field: the rest is scatter of movement.
    """
    calm = Rests(at.wrist, at.distal, np.zeros(len(at.off)))
    start = naturally(person, calm, rough=False)
    farthest = 1.15 * np.abs([person.low, person.high]).max()
    return walk(person.arm, start, farthest=farthest)


def holdable(person: Virtual, offsets: Array, rng: np.random.Generator) -> Rests:
    """Rests as :func:`rests`, with the hand drawn again where it cannot be held."""
    at = rests(person, offsets, rng)
    for _ in range(_TRIES):
        bad = [k for k, way in enumerate(held(person, at).ways) if way is None]
        if not bad:
            return at
        again = rests(
            person, offsets[bad] + rng.normal(scale=0.01, size=(len(bad), 3)), rng
        )
        for whole, part in zip(
            (at.wrist, at.distal, at.off),
            (again.wrist, again.distal, again.off),
            strict=True,
        ):
            whole[bad] = part
    raise RuntimeError(f"person {person.seed} cannot hold a hand at {offsets[bad]} m")


def exploring(
    person: Virtual, at: Rests, meant: list[Array], rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Hold P hands while meaning something, with reaches between them.

    `meant` has c at each place, frame by frame; it starts and ends at rest. Returns
    postures (T, 7), place (T,), -1 between, and c as meant (T,), NaN between.
    """
    arm, found = person.arm, held(person, at)
    parts, place, c = [], [], []
    for k, wish in enumerate(meant):
        n = len(wish)
        q = found.ways[k](person.low + wish * (person.high - person.low))
        shake = slow(n, 6, rng)
        spin = TILT * shake[:, 3:]
        R = np.array([_turned(v, np.linalg.norm(v)) for v in spin])
        q = steadied(
            arm, q, found.position[k] + DRIFT * shake[:, :3], R @ found.hand[k]
        )
        if k:
            gap = smooth(round(RATE * 1.0))[:, None]
            parts.append(parts[-1][-1] + gap * (q[0] - parts[-1][-1]))
            place.append(np.full(len(gap), -1))
            c.append(np.full(len(gap), np.nan))
        parts.append(q)
        place.append(np.full(n, k))
        c.append(wish)
    return np.concatenate(parts), np.concatenate(place), np.concatenate(c)


def _turned(vector: Array, angle: float) -> Array:
    return other_body.turn(vector / max(angle, 1e-12), np.array(angle))


def sweeps(person: Virtual, seconds: float, rng: np.random.Generator) -> Array:
    """One exploration: c from end to end and back, each time nearly as far."""
    n = round(RATE * seconds)
    t = np.arange(n) / RATE
    # Every turning point falls a little short of the end, or goes beyond.
    knots = np.arange(0, int(seconds * SWEEPS) + 3)
    ends = 0.5 + np.where(knots % 2, 0.5, -0.5) * rng.normal(1, SHORT, len(knots))
    at = t * SWEEPS + rng.uniform(0, 1)
    share = 0.5 - 0.5 * np.cos(np.pi * (at % 1))
    first = at.astype(int)
    wave = ends[first] + share * (ends[first + 1] - ends[first])
    # What means nothing lies where the range has its zero.
    rest = -person.low / (person.high - person.low)
    share = np.minimum(1, np.minimum(t, t[::-1]) / 0.5)
    return rest + (wave - rest) * share


def turning(person: Virtual, at: Rests, kind: str) -> tuple[Array, Array]:
    """Turn the hand at each rest, the elbow still: postures (T, 7), place (T,)."""
    column, most = TURNS[kind]
    start = naturally(person, at)
    wave = most * np.sin(2 * np.pi * np.arange(round(2 * RATE)) / (2 * RATE))
    rows, place = [], []
    for k in range(len(start)):
        q = np.tile(start[k], (len(wave), 1))
        q[:, 4 + column] += wave
        rows.append(q)
        place.append(np.full(len(wave), k))
    return np.concatenate(rows), np.concatenate(place)


def worn(
    person: Virtual, q: Array, rng: np.random.Generator, *, noise: float = 1e-3
) -> tuple[Array, list[str]]:
    """Markers (T, M, 3) m and labels of a right arm at (T, 7) rad, skin included."""
    markers, labels = other_body.recorded(person.body, q, rng, 0.0)
    behind = q - [0, 0, person.lag["upper"], 0, 0, 0, 0] * (q - STANDING)
    behind[:, 4] -= person.lag["fore"] * (q[:, 4] - STANDING[4])
    lagging = other_body.place(person.arm, behind)[0]
    of_skin = np.random.default_rng([33, person.seed])
    for k, label in enumerate(labels):
        if label[0] != "R":
            continue
        if label[1:] in ("UPA", "UPB", "UPC", "FRM"):
            markers[:, k] = lagging[label[1:]]
        gain = of_skin.normal(size=(7, 3))
        size = SKIN.get(label[1:], LANDMARK)
        # A radian at every joint moves it by its rms times the root of 7.
        markers[:, k] += size * np.tanh(q - STANDING) @ gain
    return markers + noise * rng.normal(size=markers.shape), labels

"""How fast, and how exact, are null spaces and angles between them? Two tables.

Random postures of the generic body between its joints' limits; CPU time of
one thread, contenders in shuffled order within each round, the median over the rounds.
Beside the time stand the largest entry of J n, the largest distance of a projector from
exact rational arithmetic (over a few postures), and how many null directions of a
straight arm were found: it has one more than others while the hand's pose is held. Of
angles it is the largest error over pairs of subspaces with planted angles from 1e-14
rad to a right angle in one pair.
"""

import argparse
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy
from scipy.linalg import null_space as scipy_null_space
from scipy.linalg import subspace_angles
from threadpoolctl import threadpool_limits

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.numerics.subspace import null_spaces, principal_angles

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from null_space_oracle import MIXED, exact_projector, mixed_pair, svd_angles

TASKS = {
    "6 x 7": ("right_arm", "pose"),
    "3 x 7": ("right_arm", "position"),
    "6 x 9": ("right_arm_clavicle", "pose"),
}
Contenders = dict[str, Callable[[], np.ndarray]]


class Loop:
    """Pinocchio from Python, one posture a time, and numpy's SVD."""

    def __init__(self, skeleton: Skeleton, chain: str, task: str) -> None:
        self.model = pin.buildModelFromXML(skeleton.urdf, pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.frame = self.model.getFrameId("right_knuckle")
        self.columns = skeleton.columns(chain_joints(chain))
        self.rows = 6 if task == "pose" else 3

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Jacobian of the hand at one configuration."""
        way = (self.frame, pin.LOCAL_WORLD_ALIGNED)
        full = pin.computeFrameJacobian(self.model, self.data, q, *way)
        return full[: self.rows, self.columns]


def rest_of_svd(J: np.ndarray) -> np.ndarray:
    """Right singular vectors with no singular value, (..., n - k, n)."""
    return np.linalg.svd(J)[2][..., J.shape[-2] :, :]


def rest_of_qr(J: np.ndarray) -> np.ndarray:
    """Last columns of a complete QR of the transpose, as rows."""
    Q = np.linalg.qr(np.swapaxes(J, -2, -1), mode="complete")[0]
    return np.swapaxes(Q[..., J.shape[-2] :], -2, -1)


def null_space_contenders(
    skeleton: Skeleton, q: np.ndarray, chain: str, task: str
) -> dict[str, Contenders]:
    """By question and name, what answers it for all postures; ours stands last."""
    loop = Loop(skeleton, chain, task)
    J = skeleton.chain_jacobian(q, chain, task=task)
    return {
        "J": {
            "pin, loop": lambda: np.stack([loop.jacobian(row) for row in q]),
            "ikns chain_jacobian": lambda: skeleton.chain_jacobian(q, chain, task=task),
        },
        "basis": {
            "scipy null_space, loop": lambda: np.stack(
                [scipy_null_space(j).T for j in J]
            ),
            "numpy SVD, batch": lambda: rest_of_svd(J),
            "numpy complete QR, batch": lambda: rest_of_qr(J),
            "ikns null_spaces": lambda: null_spaces(J)[0],
        },
        "both": {
            "pin, numpy SVD, loop": lambda: np.stack(
                [rest_of_svd(loop.jacobian(row)) for row in q]
            ),
            "ikns Skeleton.null_spaces": lambda: skeleton.null_spaces(
                q, chain, task=task
            )[0],
        },
    }


def angle_contenders(A: np.ndarray, B: np.ndarray) -> Contenders:
    """By name, what makes the principal angles of all pairs; ours stands last."""
    pairs = list(zip(A, B, strict=True))
    return {
        "scipy subspace_angles, loop": lambda: np.stack(
            [subspace_angles(a.T, b.T)[::-1] for a, b in pairs]
        ),
        "numpy cosines and sines, batch": lambda: svd_angles(A, B),
        "ikns principal_angles": lambda: principal_angles(A, B),
    }


def microseconds(
    field: Contenders, count: int, rounds: int, rng: np.random.Generator
) -> dict[str, float]:
    """Median time of each contender, us for one of `count`."""
    taken: dict[str, list[float]] = {name: [] for name in field}
    for action in field.values():
        action()  # compile
    for _ in range(rounds):
        for name in rng.permutation(list(field)):
            start = time.process_time()
            field[name]()
            taken[name].append(time.process_time() - start)
    return {name: 1e6 * float(np.median(t)) / count for name, t in taken.items()}


def errors(J: np.ndarray, basis: np.ndarray, exact: np.ndarray) -> tuple[float, float]:
    """Largest entry of J n, and distance of the first projectors from the exact."""
    few = basis[: len(exact)]
    distance = np.abs(np.swapaxes(few, 1, 2) @ few - exact).max()
    return float(np.abs(J @ np.swapaxes(basis, 1, 2)).max()), float(distance)


def row(question: str, name: str, times: dict[str, float]) -> str:
    """First columns of a contender's line; the last contender is ours."""
    ours = list(times)[-1]
    first = question if name == next(iter(times)) else ""
    return f"{first:<8}{name:<32}{times[name]:>8.3g}{times[name] / times[ours]:>8.3g}"


def processor() -> str:
    """Name of the processor, where the system tells."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    return f"{len(names)} x {names[0]}" if names else platform.processor()


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few postures and rounds")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    count, rounds, few = (200, 3, 3) if options.quick else (2000, 9, 40)
    rng = np.random.default_rng(options.seed)
    skeleton = Skeleton.load()
    print(
        f"{processor()}, Python {platform.python_version()}, numpy {np.__version__}, "
        f"scipy {scipy.__version__}, pin {pin.__version__}, seed {options.seed}, "
        f"{count} postures, {rounds} rounds"
    )
    q = np.tile(skeleton.neutral(), (count, 1))
    q[:, 7:] = rng.uniform(skeleton.lower, skeleton.upper, (count, 18))
    straight = q.copy()
    straight[:, 7 + skeleton.joint_names.index("right_elbow_flexion")] = 0.0
    print(
        f"{'':<8}{'':<32}{'us each':>8}{'x ours':>8}{'|J n|':>8}{'projector':>11}"
        f"{'straight arm':>14}"
    )
    for shape, (chain, task) in TASKS.items():
        J = skeleton.chain_jacobian(q, chain, task=task)
        exact = np.stack([exact_projector(j) for j in J[:few]])
        at_straight = null_space_contenders(skeleton, straight[:1], chain, task)
        questions = null_space_contenders(skeleton, q, chain, task)
        print(f"{shape}, hand {task}")
        for question, field in questions.items():
            times = microseconds(field, count, rounds, rng)
            for name, action in field.items():
                line = row(question, name, times)
                if question != "J":
                    seen, distance = errors(J, action(), exact)
                    directions = at_straight[question][name]().shape[1]
                    line += f"{seen:>8.0e}{distance:>11.0e}{directions:>14}"
                print(line, flush=True)
    print(f"\n{'angles':<8}{'':<32}{'us each':>8}{'x ours':>8}{'error':>8}")
    planted = np.array([mixed_pair(rng) for _ in range(count // 4)])
    pairs = {
        "1 x 7": (rng.normal(size=(2, count, 1, 7)), None),
        "4 x 7": (rng.normal(size=(2, count, 4, 7)), None),
        "6 x 12": (np.swapaxes(planted, 0, 1), MIXED),
    }
    for shape, ((A, B), truth) in pairs.items():
        field = angle_contenders(A, B)
        times = microseconds(field, len(A), rounds, rng)
        for name, action in field.items():
            line = row(shape, name, times)
            if truth is not None:
                line += f"{np.abs(action() - truth).max():>8.0e}"
            print(line, flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()

"""The house keeps its order: every import points down."""

import ast
from pathlib import Path

import pytest

# Bottom row first. A module may import from the rows below its own, and within its row
# from those before it, so imports never run in a circle.
ROWS = (
    "errors _kernels",
    "anthropometry body recording motion marker_set files rigid derivative subspace "
    "clustering interpolation bootstrap output_folder",
    "skeleton isb finger stream session",
    "marker_ik scaling nullspace_map symbolic",
    "subject calibration ucm control compare warm_up",
    "runtime simulation",
    "experiments",
    "view",
    "cli",
)
ORDER = " ".join(ROWS).split()
ONLY_IN = {
    "pinocchio": {"skeleton", "view"},
    "sklearn": {"clustering", "nullspace_map"},
    "matplotlib": {"view"},
    "meshcat": {"view"},
    "numba": {"_kernels"},
    "casadi": {"symbolic"},
    "dynamixel_sdk": {"finger"},
    "pandas": {"experiments"},
    "mujoco": {"simulation"},
    "pyarrow": {"experiments"},
    "joblib": {"experiments"},
    "dask": {"experiments"},
    "distributed": {"experiments"},
    "tornado": {"view"},
    "pylsl": {"stream"},
    "qtm_rt": {"stream"},
    "serial": {"finger"},
    "statsmodels": {"experiments"},
    "vicon_dssdk": {"stream"},
    "typer": {"cli"},
    "rich": {"cli"},
}
PACKAGE = Path(__file__).parents[1] / "ikns"
FILES = sorted(p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_point_down(path: Path) -> None:
    own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            assert node.module != "ikns", f"name the module in line {node.lineno}"
            names = [str(node.module)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for library, *inside in (name.split(".") for name in names):
            assert own in ONLY_IN.get(library, {own}), f"{own} imports {library}"
            if library == "ikns" and not inside:  # all public names: from above only
                assert own == "cli", f"{own} imports the whole package"
            elif library == "ikns" and inside[0] != own:
                assert ORDER.index(inside[0]) < ORDER.index(own), (
                    f"{own} imports {inside[0]}"
                )


def test_every_room_is_in_the_plan() -> None:
    assert {p.relative_to(PACKAGE).parts[0].removesuffix(".py") for p in FILES} <= set(
        ORDER
    )

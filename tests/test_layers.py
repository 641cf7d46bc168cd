"""Imports point down, and there is no circle of files."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

# Lowest level first. A package imports from lower levels and from itself; packages on
# one level do not know each other.
LEVELS = (
    "arrays errors endings",
    "_kernels output",
    "numerics",
    "recording finger statistics",
    "body",
    "motion",
    "nullspace",
    "calibration analysis",
    "live symbolic",
    "simulation",
    "experiments",
    "view",
    "cli",
)
LEVEL = {
    package: level
    for level, packages in enumerate(LEVELS)
    for package in packages.split()
}
ONLY_IN = {
    "pinocchio": {"body", "view"},
    "sklearn": {"nullspace"},
    "matplotlib": {"view"},
    "PIL": {"view"},
    "meshcat": {"view"},
    "llvmlite": {"_kernels"},
    "numba": {"_kernels"},
    "casadi": {"symbolic"},
    "dynamixel_sdk": {"finger"},
    "pandas": {"statistics", "motion"},
    "xarray": {"motion"},
    "pyxdf": {"recording"},
    "mujoco": {"simulation"},
    "pyarrow": {"experiments"},
    "joblib": {"experiments"},
    "dask": {"experiments"},
    "distributed": {"experiments"},
    "tornado": {"experiments", "view"},
    "pylsl": {"live"},
    "lerobot": {"finger", "live"},
    "draccus": {"finger"},
    "yaml": {"finger"},
    "natnet": {"live"},
    "qtm_rt": {"live"},
    "serial": {"finger"},
    "statsmodels": {"statistics"},
    "vicon_dssdk": {"live"},
    "zenoh": {"finger"},
    "rerun": {"view"},
    "typer": {"cli"},
    "rich": {"cli"},
}
PACKAGE = Path(__file__).parents[1] / "ikns"
FILES = sorted(p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py")


def module_of(path: Path) -> str:
    """Dotted name within the package."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in FILES}


@cache
def imports(path: Path) -> list[tuple[int, str]]:
    """Line and dotted name of all that a file imports, TYPE_CHECKING included."""
    return list(_imports(path))


def _imports(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            assert node.module not in {None, "ikns"}, f"line {node.lineno}: which one?"
            for alias in node.names:
                inside = f"{node.module}.{alias.name}"
                known = inside.removeprefix("ikns.") in MODULES
                yield node.lineno, inside if known else str(node.module)
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)


@pytest.mark.parametrize("path", FILES, ids=module_of)
def test_imports_point_down(path: Path) -> None:
    own = module_of(path).split(".")[0]
    for line, name in imports(path):
        library, _, inside = name.partition(".")
        assert own in ONLY_IN.get(library, {own}), f"line {line}: {own} takes {name}"
        package = inside.split(".")[0]
        if library == "ikns" and not package:  # all public names: from above only
            assert own == "cli", f"line {line}: {own} imports the whole package"
        elif library == "ikns" and package != own:
            assert LEVEL[package] < LEVEL[own], f"line {line}: {own} imports {name}"


def test_every_package_has_a_level() -> None:
    packages = {module_of(path).split(".")[0] for path in FILES}
    assert packages == set(LEVEL)


def circle(arrows: dict[str, set[str]]) -> list[str]:
    """A way from a file back to itself, or nothing."""
    done: set[str] = set()

    def follow(name: str, way: list[str]) -> list[str]:
        if name in way:
            return [*way[way.index(name) :], name]
        if name in done:
            return []
        for other in sorted(arrows.get(name, ())):
            if found := follow(other, [*way, name]):
                return found
        done.add(name)
        return []

    return next((found for name in arrows if (found := follow(name, []))), [])


def test_a_circle_is_found() -> None:
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert circle({"a": {"b", "c"}, "b": {"c"}}) == []


def test_no_file_waits_for_itself() -> None:
    # A package's `__init__` counts as a file: it waits for all that it gathers, so none
    # of these may import from it.
    arrows = {
        module: {
            name.removeprefix("ikns.")
            for _, name in imports(path)
            if name.startswith("ikns.")
        }
        - {module}
        for module, path in MODULES.items()
    }
    assert circle(arrows) == []

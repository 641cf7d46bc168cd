"""Machine code is kept for exactly the sources that it was made from."""

import ast
import functools
import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from ikns._kernels import cache_folder as module
from ikns._kernels import compiled
from ikns._kernels.body.frame_sequence import solve_frames
from ikns._kernels.body.label_changes import label_owners
from ikns.body.skeleton import Skeleton
from ikns.live.warm_up import compiled_before, warm_up
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.label_changes import label_changes

KERNELS = Path(module.__file__).parent


def forget() -> None:
    """Forget what was read of the sources, as a new process has."""
    module._source.cache_clear()
    module.cache_folder.cache_clear()


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the kernels' sources that the cache looks at."""
    shutil.copytree(
        KERNELS, tmp_path, ignore=lambda *_: {"__pycache__"}, dirs_exist_ok=True
    )
    monkeypatch.setattr(module, "_HERE", tmp_path)
    monkeypatch.setattr(module.config, "CACHE_DIR", "")
    forget()
    yield tmp_path
    forget()


def folder_of(name: str) -> Path:
    forget()
    folder = module.cache_folder(name)
    assert folder is not None
    return folder


def test_a_change_in_what_is_called_gives_a_new_folder(copy):
    before = {
        name: folder_of(name)
        for name in ("body.marker_ik", "body.step", "voronoi.hull")
    }
    source = copy / "body" / "step.py"
    source.write_text(source.read_text() + "\n# changed\n")
    after = {name: folder_of(name) for name in before}
    assert after["body.step"] != before["body.step"]
    assert after["body.marker_ik"] != before["body.marker_ik"]  # it imports step
    assert after["voronoi.hull"] == before["voronoi.hull"]


def test_code_is_kept_elsewhere_where_the_package_is_read_only(copy, monkeypatch):
    home = copy / "home"
    (copy / "__pycache__").write_text("in the way, as a read-only folder would be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    assert folder_of("body.step").is_relative_to(home / "ikns")


def test_without_any_place_code_is_compiled_and_not_kept(copy, monkeypatch):
    (copy / "__pycache__").write_text("in the way")
    (copy / "home").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(copy / "home"))
    forget()
    assert module.cache_folder("body.step") is None
    assert not module.on_disk("body.step")
    assert not module.can_keep("body.step")
    assert compiled_before()  # nothing is gained by compiling ahead


def test_numba_is_asked_to_keep_code_where_the_user_wants_it(copy, monkeypatch):
    monkeypatch.setattr(module.config, "CACHE_DIR", str(copy / "wanted"))
    assert folder_of("body.step").is_relative_to(copy / "wanted")


def calls(node: ast.AST) -> set[str]:
    return {
        ast.unparse(call.func) for call in ast.walk(node) if isinstance(call, ast.Call)
    }


@functools.cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def kernels_of(path: Path) -> tuple[set[str], set[str], list[ast.FunctionDef]]:
    """Names of kernels without a wrapper for Python, and of all; other functions."""
    bare, kernels, plain = set(), set(), []
    for node in tree_of(path).body:
        if isinstance(node, ast.FunctionDef):
            marks = {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
            if not marks & {"compiled", "borrowing", "inner", "inner_borrowing"}:
                plain.append(node)
                continue
            kernels.add(node.name)
            if marks & {"inner", "inner_borrowing"} or node.name.startswith("_"):
                bare.add(node.name)
    return bare, kernels, plain


@functools.cache
def imported(path: Path) -> dict[str, tuple[Path, str]]:
    """Names taken from kernel files: the file, and the name there."""
    found, modules = {}, {}
    if "ikns._kernels" not in path.read_text(encoding="utf-8"):
        return found
    tree = tree_of(path)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            if node.module.startswith("ikns._kernels"):
                place = KERNELS.joinpath(*node.module.split(".")[2:])
                for alias in node.names:
                    name = alias.asname or alias.name
                    modules[name] = (place / alias.name).with_suffix(".py")
                    found[name] = place.with_suffix(".py"), alias.name
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            file = modules.get(node.value.id)
            if file is not None and file.is_file():
                found[ast.unparse(node)] = file, node.attr
    return found


@pytest.mark.parametrize("path", sorted(KERNELS.rglob("*.py")), ids=lambda p: p.stem)
def test_python_never_calls_a_kernel_without_a_wrapper(path):
    # It would end the process without a word.
    bare, _, plain = kernels_of(path)
    taken = {
        name
        for name, (file, there) in imported(path).items()
        if file.is_file() and there in kernels_of(file)[0]
    }
    bare = bare | taken
    assert not any(calls(node) & bare for node in plain)


def test_no_other_module_imports_a_kernel_without_a_wrapper():
    root = KERNELS.parents[1]
    bare = {path: kernels_of(path)[0] for path in KERNELS.rglob("*.py")}
    for path in (
        p for d in ("ikns", "tests", "benchmarks") for p in root.glob(f"{d}/**/*.py")
    ):
        if KERNELS in path.parents:
            continue
        for file, name in imported(path).values():
            assert name not in bare.get(file, ()), path


def test_kernels_that_only_kernels_call_have_no_wrapper():
    # A wrapper that unpacks a tuple of forty arrays takes longer than the kernel.
    root = KERNELS.parents[1]
    used = set()
    for path in (
        p for d in ("ikns", "tests", "benchmarks") for p in root.glob(f"{d}/**/*.py")
    ):
        names = dict(imported(path))
        if KERNELS in path.parents:
            _, own, plain = kernels_of(path)
            names |= {name: (path, name) for name in own}
            called = set().union(*(calls(node) for node in plain))
            used |= {names[name] for name in called & set(names)}
        else:
            used |= set(names.values())
    for path in KERNELS.rglob("*.py"):
        bare, kernels, _ = kernels_of(path)
        assert {name for file, name in used if file == path} >= kernels - bare, path


def test_a_constant_is_no_reason_to_compile_again():
    half = numba.njit(lambda x, half: x / 2 if half else x)
    compiled._take_constants_as_values(half)

    @numba.njit
    def both(x: float) -> tuple[float, float]:
        return half(x, True), half(x, False)

    assert both(4.0) == (2.0, 4.0)
    assert len(half.signatures) == 1
    for path in KERNELS.rglob("*.py"):
        name = ".".join(path.relative_to(KERNELS.parents[1]).with_suffix("").parts)
        for kernel in vars(importlib.import_module(name)).values():
            for signature in getattr(kernel, "signatures", ()):
                assert "Literal" not in str(signature), kernel


def test_an_array_that_is_read_only_is_no_reason_to_compile_again():
    skeleton = Skeleton.load()
    markers = skeleton.markers_in_world(skeleton.neutral())
    solver = MarkerIK(skeleton)
    q = solver.solve(markers).q
    before = set(solve_frames.signatures), set(label_owners.signatures)
    for array in (markers, q):
        array.flags.writeable = False
    solver.solve(markers, q)
    label_changes(np.zeros(1), np.broadcast_to(markers, (1, *markers.shape)))
    time = np.zeros(1)
    time.flags.writeable = False
    label_changes(time, markers[None])
    assert set(solve_frames.signatures) == before[0]
    assert len(set(label_owners.signatures) - before[1]) <= 1


def test_importing_the_package_does_not_load_numba():
    script = "import sys, ikns; print('numba' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert said.stdout.strip() == "False"


def test_kept_code_runs_without_the_compiler_which_still_works_afterwards():
    warm_up()  # all is on disk now
    script = (
        "import sys, numba, numpy as np\n"
        "from ikns.live.warm_up import warm_up\n"
        "warm_up()\n"
        "assert 'numba.np.arraymath' not in sys.modules\n"
        "assert numba.njit(lambda x: (x @ x).sum())(np.ones((2, 2))) == 8\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)

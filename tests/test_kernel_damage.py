"""Damaged machine code is noticed, compiled again, and the same numbers come out."""

import importlib.util
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ikns._kernels import cache_folder as module
from ikns._kernels import linking, machine_code

KERNELS = Path(module.__file__).parent
SMALL = """
from ikns._kernels.compiled import compiled

@compiled
def _square(x):
    return x * x

@compiled
def small(values):
    total = 0.0
    for value in values:
        total += _square(value) / 3.0
    return total
"""
VALUES = np.array([0.1, 0.2, 0.7])


def load(place: Path) -> ModuleType:
    """Import the small kernel anew, as another process would."""
    spec = importlib.util.spec_from_file_location(
        "ikns._kernels.small", place / "small.py"
    )
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made  # where numba looks for its globals
    spec.loader.exec_module(made)
    return made


def loaded(kernel: Callable[..., float]) -> bool:
    """Whether the code of a kernel that was called came from the disk."""
    statistics = kernel.stats  # type: ignore[attr-defined]
    return not statistics.cache_misses


def files(place: Path) -> list[Path]:
    return sorted(place.rglob("*.nbc"))


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of kernels with a small one that was compiled, and calls another."""
    monkeypatch.setattr(linking, "_SMALL", 0)  # even that one is called by name
    for name in ("compiled", "cache_folder", "linking", "machine_code"):
        shutil.copy(KERNELS / f"{name}.py", tmp_path)
    (tmp_path / "small.py").write_text(SMALL)
    monkeypatch.setattr(module, "_HERE", tmp_path)
    monkeypatch.setattr(module.config, "CACHE_DIR", "")
    module.cache_folder.cache_clear()
    assert load(tmp_path).small(VALUES) == expected()
    assert len(files(tmp_path)) == 2
    machine_code._SAID.clear()
    yield tmp_path
    del sys.modules["ikns._kernels.small"]
    machine_code._SAID.clear()
    module.cache_folder.cache_clear()


def expected() -> float:
    total = 0.0
    for value in VALUES:
        total += value * value / 3.0
    return total


def check_repaired(
    place: Path, capsys: pytest.CaptureFixture[str], named: Path
) -> None:
    """The same number comes out, one sentence says why, and the files are whole."""
    machine_code._SAID.clear()
    again = load(place)
    assert again.small(VALUES) == expected()
    assert not loaded(again.small) or not loaded(again._square)
    said = capsys.readouterr().err
    assert said.startswith("ikns: ")
    assert said.count("\n") == 1
    assert str(named.parent) in said
    whole = load(place)
    assert whole.small(VALUES) == expected()
    assert loaded(whole.small)
    assert capsys.readouterr().err == ""


def test_kept_code_is_loaded_and_only_the_user_can_change_it(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = load(place)
    assert again.small(VALUES) == expected()
    assert loaded(again.small)
    assert capsys.readouterr().err == ""
    (folder,) = {path.parent for path in files(place)}
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(p.stat().st_mode) for p in files(place)} == {0o600}
    assert {p.suffix for p in folder.iterdir()} == {".nbc"}  # no unfinished files


def test_a_kernel_does_not_hold_the_code_of_what_it_calls_by_name(
    place: Path,
) -> None:
    for path in files(place):
        path.unlink()
    made = load(place)
    made.small(VALUES)
    (result,) = made.small.overloads.values()
    found = {f.name: f for f in result.library._final_module.functions}
    (name,) = (r.fndesc.mangled_name for r in made._square.overloads.values())
    assert found[name].is_declaration
    assert not found[result.fndesc.mangled_name].is_declaration


def test_what_a_kernel_calls_by_name_is_loaded_with_it_or_compiled_again(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = load(place)
    again.small(VALUES)
    assert loaded(again._square)
    find(place, "_square").unlink()
    again = load(place)
    assert again.small(VALUES) == expected()
    assert loaded(again.small)
    assert not loaded(again._square)
    assert capsys.readouterr().err == ""


def find(place: Path, name: str) -> Path:
    (path,) = place.rglob(f"{name}-*.nbc")
    return path


CHANGES = st.one_of(
    st.tuples(st.just("cut"), st.floats(0, 1), st.just(0)),
    st.tuples(st.just("flip"), st.floats(0, 1), st.integers(1, 255)),
    st.tuples(st.just("zeros"), st.floats(0, 1), st.just(0)),
    st.tuples(st.just("more"), st.just(0.0), st.integers(0, 255)),
)


@given(change=CHANGES)
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_happens_to_a_file_the_numbers_stay(
    change: tuple[str, float, int], place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = find(place, "small")
    content = bytearray(path.read_bytes())
    what, share, byte = change
    at = min(int(share * len(content)), len(content) - 1)
    if what == "cut":
        del content[at:]
    elif what == "flip":
        content[at] ^= byte
    elif what == "zeros":  # blocks that were never written
        content[at:] = bytes(len(content) - at)
        content[at - 1 if at else 0] ^= 1
    else:
        content.append(byte)
    path.write_bytes(content)
    check_repaired(place, capsys, path)


def empty(path: Path, other: Path) -> None:
    path.write_bytes(b"")


def exchange(path: Path, other: Path) -> None:
    """Whole, but not of this kernel."""
    path.write_bytes(other.read_bytes())


def unreadable_link(path: Path, other: Path) -> None:
    path.unlink()
    path.symlink_to(path)


def pickled(path: Path, other: Path) -> None:
    """Whole, but not machine code."""
    path.write_bytes(machine_code._digest(path, b"N.") + b"N.")


@pytest.mark.parametrize("damage", [empty, exchange, unreadable_link, pickled])
def test_a_file_that_is_something_else_is_replaced(
    place: Path,
    capsys: pytest.CaptureFixture[str],
    damage: Callable[[Path, Path], None],
) -> None:
    path = find(place, "small")
    damage(path, find(place, "_square"))
    check_repaired(place, capsys, path)


def test_all_files_damaged_at_once_are_one_sentence(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in files(place):
        os.truncate(path, path.stat().st_size // 2)
    check_repaired(place, capsys, files(place)[0])


def test_a_folder_in_the_place_of_a_file_is_said(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = find(place, "small")
    path.unlink()
    path.mkdir()
    for _ in range(2):
        machine_code._SAID.clear()
        assert load(place).small(VALUES) == expected()
        said = capsys.readouterr().err
        assert "found a damaged file" in said
        assert "cannot be stored: is a directory" in said


def test_a_full_disk_is_said_and_the_numbers_stay(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, os.strerror(28))

    for path in files(place):
        path.unlink()
    monkeypatch.setattr(machine_code.tempfile, "NamedTemporaryFile", full)
    assert load(place).small(VALUES) == expected()
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "cannot be stored: no space left on device" in said


@pytest.mark.parametrize("mode", [0o770, 0o702, 0o777])
def test_code_that_others_could_have_written_is_not_run(
    place: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    mode: int,
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(place / "home"))
    (folder,) = {path.parent for path in files(place)}
    folder.chmod(mode)
    module.cache_folder.cache_clear()
    again = load(place)
    assert again.small(VALUES) == expected()
    assert not loaded(again.small)
    assert "found another; machine code is not stored there" in capsys.readouterr().err
    assert again.small.stats.cache_path.startswith(str(place / "home" / "ikns"))


def test_code_of_another_user_or_behind_a_link_is_not_run(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder,) = {path.parent for path in files(place)}
    assert machine_code.is_private(folder)
    (place / "link").symlink_to(folder)
    assert not machine_code.is_private(place / "link")
    own = os.geteuid()
    monkeypatch.setattr(machine_code.os, "geteuid", lambda: own + 1)
    assert not machine_code.is_private(folder)


TOGETHER = """
import importlib.util, sys
from pathlib import Path
import numpy as np
from ikns._kernels import cache_folder as module
place = Path(sys.argv[1])
module._HERE = place
spec = importlib.util.spec_from_file_location("ikns._kernels.small", place / "small.py")
made = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = made
spec.loader.exec_module(made)
sys.stdin.readline()  # all begin together
print(*(made.small(np.arange(4).astype(kind)) for kind in sys.argv[2:]))
"""


def test_processes_that_compile_at_once_do_not_disturb_each_other(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in files(place):
        path.unlink()
    kinds = ["float64", "float32", "int64"]
    running = [
        subprocess.Popen(
            [sys.executable, "-c", TOGETHER, str(place), *kinds[k:], *kinds[:k]],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"},
        )
        for k in range(3)
    ]
    for process in running:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    for process in running:
        out, err = process.communicate(timeout=300)
        # Sum of squares to 3, exact in single precision but for the third.
        np.testing.assert_allclose([float(x) for x in out.split()], 14 / 3, rtol=3e-7)
        assert err == ""
    again = load(place)
    for kind in kinds:
        again.small(np.arange(4).astype(kind))
    assert loaded(again.small)
    assert capsys.readouterr().err == ""

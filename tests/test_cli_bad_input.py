"""Bad input gets one sentence, exit code 2, and leaves earlier output untouched."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import small_person
from command_line import calibrate, check_refused

from ikns.cli import main
from ikns.recording.recording import Recording


def rename(recording: Recording, change: Callable[[str], str]) -> Recording:
    labels = [change(label) for label in recording.labels]
    return Recording(recording.time, recording.markers, labels, recording.source)


def without(recording: Recording, *dropped: str) -> Recording:
    return recording.select([name for name in recording.labels if name not in dropped])


def moved(recording: Recording, markers: np.ndarray) -> Recording:
    return Recording(recording.time, markers, recording.labels, recording.source)


def one_face(recording: Recording) -> Recording:
    """Only the time at four points in a plane."""
    run = small_person.protocol()
    corners = np.argsort(run.places[:8, 1])[:4]  # the lower face
    rows = np.isin(run.points.point, corners)
    time = np.arange(rows.sum()) / 50
    return Recording(time, recording.markers[rows], recording.labels, recording.source)


def trc(recording: Recording, *, labels: list[str] | None = None, back: int = 0) -> str:
    """Return a TRC file; frame `back` goes back in time."""
    names = labels or list(recording.labels)
    time = recording.time.copy()
    if back:
        time[back] = time[back - 1] - 0.01
    lines = ["PathFileType\t4\t(X/Y/Z)\tt.trc"]
    lines += ["DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"]
    lines += [f"50\t50\t{len(time)}\t{len(names)}\tmm"]
    lines += ["Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t"]
    lines += [
        "\t\t" + "\t".join(f"{x}{i + 1}" for i in range(len(names)) for x in "XYZ")
    ]
    for i, frame in enumerate(1000 * recording.markers):
        cells = ["" if np.isnan(x) else f"{x:.3f}" for x in frame.ravel()]
        lines.append("\t".join([str(i + 1), f"{time[i]:.3f}", *cells]))
    return "\n".join(lines) + "\n"


def c3d(change: Callable[[Recording], Recording]) -> Callable[[Path, Recording], Path]:
    return lambda folder, recording: small_person.write(
        folder, "bad", change(recording)
    )


def text(make: Callable[[Recording], str]) -> Callable[[Path, Recording], Path]:
    def write(folder: Path, recording: Recording) -> Path:
        path = folder / "bad.trc"
        path.write_text(make(recording))
        return path

    return write


def raw(name: str, data: bytes) -> Callable[[Path, Recording], Path]:
    def write(folder: Path, recording: Recording) -> Path:
        (folder / name).write_bytes(data)
        return folder / name

    return write


def truncated(folder: Path, recording: Recording) -> Path:
    path = small_person.write(folder, "bad", recording)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def infinite(recording: Recording) -> str:
    lines = trc(recording).splitlines()
    cells = lines[7].split("\t")
    cells[2] = "inf"
    return "\n".join([*lines[:7], "\t".join(cells), *lines[8:]]) + "\n"


BAD_RECORDINGS = {
    "missing": lambda folder, recording: folder / "nowhere.c3d",
    "a folder": lambda folder, recording: folder,
    "empty": raw("bad.c3d", b""),
    "not what its name says": raw("bad.c3d", b"PathFileType\t4\n" * 100),
    "unknown ending": raw("bad.mat", b"x"),
    "truncated": truncated,
    "wrong units": c3d(lambda r: moved(r, 1000 * r.markers)),
    "no recognised marker": c3d(lambda r: rename(r, lambda name: f"Q{name}Q")),
    "two people": c3d(
        lambda r: rename(
            r, lambda name: f"A:{name}" if name[0] == "R" else f"B:R{name[1:]}"
        )
    ),
    "a segment without markers": c3d(lambda r: without(r, "RFIN")),
    "never seen": c3d(lambda r: moved(r, np.full_like(r.markers, np.nan))),
    "infinite": text(infinite),
    "duplicate labels": text(
        lambda r: trc(r, labels=["C7", "C7", *list(r.labels)[2:]])
    ),
    "time goes back": text(lambda r: trc(r, back=5)),
}
BAD_STATICS = BAD_RECORDINGS | {
    "shorter than 1 s": c3d(lambda r: small_person.cut(r, 0, 20)),
}
BAD_EXPLORATIONS = BAD_RECORDINGS | {
    "a single frame": text(lambda r: trc(small_person.cut(r, 0, 1))),
    "fewer samples than points": c3d(lambda r: small_person.cut(r, 30, 36)),
    "points in a plane": c3d(one_face),
}


@pytest.mark.parametrize("what", BAD_STATICS)
def test_a_bad_static_trial_is_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], what: str
) -> None:
    static = BAD_STATICS[what](tmp_path, small_person.protocol().static.recording)
    argv = calibrate(static, files / "points.c3d", out=tmp_path / "person")
    check_refused(argv, tmp_path, capfd, names=static)


@pytest.mark.parametrize("what", BAD_EXPLORATIONS)
def test_a_bad_exploration_is_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], what: str
) -> None:
    recording = small_person.protocol().points.recording
    if what != "points in a plane":
        recording = small_person.cut(recording, 0, 60)
    bad = BAD_EXPLORATIONS[what](tmp_path, recording)
    argv = calibrate(files / "static.c3d", bad, out=tmp_path / "person")
    check_refused(argv, tmp_path, capfd, names=bad)


def test_a_hand_that_is_never_still_is_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    recording = small_person.cut(small_person.protocol().points.recording, 0, 60)
    rushed = Recording(
        recording.time / 100, recording.markers, recording.labels, "rushed"
    )
    fast = small_person.write(tmp_path, "fast", rushed)
    argv = calibrate(files / "static.c3d", fast, out=tmp_path / "person")
    assert "slower than 0.05 m/s" in check_refused(argv, tmp_path, capfd, names=fast)


@pytest.mark.parametrize("command", ["ik", "control", "compare"])
@pytest.mark.parametrize("what", ["missing", "truncated", "no recognised marker"])
def test_a_bad_recording_is_told_in_a_sentence(
    files: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    command: str,
    what: str,
) -> None:
    recording = small_person.cut(small_person.protocol().points.recording, 0, 20)
    bad = BAD_RECORDINGS[what](tmp_path, recording)
    argv = [command, "--subject", str(files / "person"), str(bad)]
    if command != "compare":
        (tmp_path / "old.csv").write_text("precious")
        argv += ["--out", str(tmp_path / "old.csv"), "--force"]
    check_refused(argv, tmp_path, capfd, names=bad)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["dance"], "dance"),
        (["scale", "--stature", "tall"], "--stature"),
        (["scale", "--stature", "1.7"], "--mass"),
        (["scale", *"--stature 17 --mass 70 --sex male --out m.urdf".split()], "17"),
        (["scale", *"--stature 1.7 --mass nan --sex male --out m.urdf".split()], "nan"),
        (["scale", *"--stature 1.7 --mass 70 --sex cat --out m.urdf".split()], "cat"),
        (
            ["scale", *"--stature 1.7 --mass 70 --sex male --out no/m.urdf".split()],
            "no/m.urdf",
        ),
        (["ik", "--subject", "nobody", "free.c3d"], "nobody"),
        (["calibrate", *"--static s --exploration e --out no/p".split()], "no/p"),
        (
            ["calibrate", *"--static s --exploration e --out p --mass 70".split()],
            "--mass",
        ),
        (
            ["calibrate", *"--static s --exploration e --out p --side up".split()],
            "up",
        ),
    ],
)
def test_bad_arguments_are_told_in_a_sentence(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    argv: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in check_refused(argv, tmp_path, capfd)


@pytest.mark.parametrize(
    "options",
    [
        ["--points", "0"],
        ["--n-dof", "8"],
        ["--radius", "-1"],
        ["--marker-set", "lost"],
        ["--min-static", "9"],
        ["--min-still", "nan"],
        ["--min-still", "-1"],
    ],
)
def test_settings_out_of_range_are_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], options: list[str]
) -> None:
    recording = small_person.cut(small_person.protocol().points.recording, 0, 60)
    exploration = small_person.write(tmp_path, "short", recording)
    argv = calibrate(
        files / "static.c3d", exploration, *options, out=tmp_path / "person"
    )
    assert options[1] in check_refused(argv, tmp_path, capfd)


@pytest.mark.parametrize("name", ["map.json", "skeleton.urdf"])
def test_a_damaged_subject_is_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    small_person.subject().save(tmp_path / "person")
    path = tmp_path / "person" / name
    path.write_bytes(path.read_bytes()[:500])
    argv = ["ik", "--subject", str(tmp_path / "person"), str(files / "free.c3d")]
    argv += ["--out", str(tmp_path / "motion.csv")]
    check_refused(argv, tmp_path, capfd, names=path)


def test_files_are_only_overwritten_by_force(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "model.urdf"
    argv = "scale --stature 1.7 --mass 70 --sex male --out".split()
    assert main([*argv, str(out)]) == 0
    capfd.readouterr()
    assert "--force" in check_refused([*argv, str(out)], tmp_path, capfd, names=out)
    out.write_text("old")
    assert main([*argv, str(out), "--force"]) == 0
    assert out.read_text().startswith("<?xml")
    assert [path.name for path in tmp_path.iterdir()] == ["model.urdf"]


def test_the_program_itself_exits_with_2_and_without_a_traceback(
    tmp_path: Path,
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from ikns.cli import main; raise SystemExit(main())"]
        + "ik --subject nobody free.c3d".split(),
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("ikns: nobody: ")
    assert done.stderr.count("\n") == 1

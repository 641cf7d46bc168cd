"""Whatever the bytes: a recording or one sentence, soon and in little memory."""

import struct
import subprocess
import sys
import textwrap
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import IknsError, RecordingWarning
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording

TEXT = ["csv", "trc", "tsv", "motive.csv", "workstation.csv"]
LABELS = ["S:RSHO", "S:RELB", "S:RWRA", "S:RFIN"]


def sound_files(folder):
    """Write one recording in each format; return the contents by ending."""
    markers = np.random.default_rng(1).normal(size=(6, 4, 3)).round(3)
    write_c3d(folder / "sound.c3d", Recording(np.arange(6) / 100, markers, LABELS))
    flat = (1000 * markers).reshape(6, 12)
    head = "Trajectories\n100\n,," + ",,,".join(LABELS) + "\nFrame,Sub Frame"
    head += ",X,Y,Z" * 4 + "\n," + ",mm" * 12 + "\n"
    csv = head + "".join(
        f"{i + 1},0," + ",".join(map(str, row)) + "\n" for i, row in enumerate(flat)
    )
    head = "PathFileType\t4\t(X/Y/Z)\tx\nDataRate\tNumFrames\tNumMarkers\tUnits\n"
    head += "100\t6\t4\tmm\nFrame#\tTime\t" + "\t\t\t".join(LABELS) + "\n\t\tX1\n\n"
    trc = head + "".join(
        f"{i + 1}\t{i / 100}\t" + "\t".join(map(str, row)) + "\n"
        for i, row in enumerate(flat)
    )
    c3d = (folder / "sound.c3d").read_bytes()
    text = {"csv": csv, "trc": trc} | others(flat)
    return {"c3d": c3d} | {name: found.encode() for name, found in text.items()}


def others(flat):
    """The same recording as Qualisys, Motive and Vicon Workstation export it."""
    rows = [list(map(str, row)) for row in flat]
    head = "NO_OF_FRAMES\t6\nNO_OF_MARKERS\t4\nFREQUENCY\t100\nDATA_INCLUDED\t3D\n"
    tsv = head + "MARKER_NAMES\t" + "\t".join(LABELS) + "\n"
    tsv += "".join("\t".join(row) + "\n" for row in rows)
    names = "".join(f",{label}" * 3 for label in LABELS)
    motive = "Format Version,1.23,Export Frame Rate,100,Length Units,Millimeters\n\n"
    motive += f",Type{',Marker' * 12}\n,Name{names}\n,{',Position' * 12}\n"
    motive += f"Frame,Time (Seconds){',X,Y,Z' * 4}\n"
    old = "TRAJECTORIES\n100,Hz\n," + ",,,".join(LABELS) + ",,\n"
    old += f"Field #{',X,Y,Z' * 4}\n"
    for i, row in enumerate(rows):
        motive += f"{i},{i / 100},{','.join(row)}\n"
        old += f"{i + 1},{','.join(row)}\n"
    return {"tsv": tsv, "motive.csv": motive, "workstation.csv": old}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return sound_files(tmp_path_factory.mktemp("sound"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


def survives(folder, ending, content):
    """Read; anything but a recording or one printable sentence fails."""
    path = folder / f"trial.{ending}"
    path.write_bytes(content)
    complaint = ""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", RecordingWarning)
        try:
            read(path)
        except IknsError as error:
            complaint = str(error)
    assert complaint.isprintable()
    assert all(str(warning.message).isprintable() for warning in told)


@pytest.mark.parametrize("ending", ["c3d", *TEXT])
def test_sound_files_are_read(sound, folder, ending):
    path = folder / f"sound.{ending}"
    path.write_bytes(sound[ending])
    assert read(path).labels == tuple(LABELS)


@pytest.mark.parametrize("ending", TEXT)
def test_text_cut_at_any_byte_survives(sound, folder, ending):
    step = 1 if ending in ("csv", "trc") else 3
    for end in range(0, len(sound[ending]), step):
        survives(folder, ending, sound[ending][:end])


def test_c3d_cut_at_any_byte_is_refused(sound, folder):
    path = folder / "cut.c3d"
    (block,) = struct.unpack_from("<H", sound["c3d"], 16)
    last = 512 * (block - 1) + 6 * len(LABELS) * 16  # after it only padding
    for end in range(last):
        path.write_bytes(sound["c3d"][:end])
        with pytest.raises(IknsError, match=r"cut off|empty|not a C3D file"):
            read(path)


BYTES = st.sampled_from([0, 1, 2, 9, 10, 44, 48, 57, 127, 128, 255]) | st.integers(
    0, 255
)


@pytest.mark.parametrize("ending", ["c3d", *TEXT])
@settings(max_examples=100, deadline=None)
@given(changes=st.lists(st.tuples(st.integers(0), BYTES), min_size=1, max_size=8))
def test_flipped_bytes_survive(sound, folder, ending, changes):
    content = bytearray(sound[ending])
    for place, byte in changes:
        content[place % len(content)] = byte
    survives(folder, ending, content)


@pytest.mark.parametrize("ending", ["c3d", "csv", "trc"])
@settings(max_examples=60, deadline=None)
@given(
    other=st.sampled_from(["c3d", "csv", "trc"]),
    cut=st.integers(0),
    start=st.integers(0),
)
def test_heads_on_the_wrong_bodies_survive(sound, folder, ending, other, cut, start):
    head, body = sound[ending], sound[other]
    survives(folder, ending, head[: cut % len(head)] + body[start % len(body) :])


@pytest.mark.parametrize("ending", ["c3d", *TEXT])
@settings(max_examples=40, deadline=None)
@given(place=st.integers(0), insert=st.binary(max_size=40))
def test_inserted_garbage_survives(sound, folder, ending, place, insert):
    content = sound[ending]
    place %= len(content)
    survives(folder, ending, content[:place] + insert + content[place:])


@pytest.mark.parametrize("ending", ["c3d", "csv", "trc"])
@settings(max_examples=60, deadline=None)
@given(content=st.binary(max_size=2000))
def test_garbage_survives(folder, ending, content):
    survives(folder, ending, content)


def test_huge_counts_ask_for_no_memory(sound, folder):
    """Read headers that promise terabytes in a process that may have 1.5 GB."""
    c3d = bytearray(sound["c3d"])
    struct.pack_into("<HHHH", c3d, 2, 65535, 65535, 1, 65535)
    (folder / "header.c3d").write_bytes(c3d)
    c3d = bytearray(sound["c3d"])
    frames = c3d.index(b"FRAMES") + 6 + 4
    struct.pack_into("<H", c3d, frames, 65535)
    last = c3d.index(b"ACTUAL_END_FIELD") + 16 + 5
    struct.pack_into("<HH", c3d, last, 65535, 65535)
    (folder / "frames.c3d").write_bytes(c3d)
    # One parameter of 255^7 elements, one of as many but none in the last dimension.
    for end in (255, 0):
        c3d = bytearray(sound["c3d"])
        at = c3d.index(b"LABELS") + 6 + 3
        c3d[at : at + 8] = bytes([7, 255, 255, 255, 255, 255, 255, end])
        (folder / f"dimensions{end}.c3d").write_bytes(c3d)
    wide = b"Trajectories\n100\n,," + b"A,,," * 100_000 + b"\nFrame,Sub Frame"
    wide += b",X,Y,Z" * 100_000 + b"\n,," + b"mm," * 300_000 + b"\n"
    (folder / "wide.csv").write_bytes(wide + b"1\n" * 100_000)
    script = f"""
        import resource
        from pathlib import Path
        resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))
        from ikns.errors import FileError
        from ikns.recording.files import read
        for name in "header frames dimensions255 dimensions0".split():
            try:
                read(Path({str(folder)!r}) / (name + ".c3d"))
            except FileError as error:
                print(name, error)
        try:
            read(Path({str(folder)!r}) / "wide.csv")
        except FileError as error:
            print("wide", error)
    """
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    refused = [line.split(" ", 1)[0] for line in run.stdout.splitlines()]
    assert refused == ["header", "frames", "dimensions255", "dimensions0", "wide"]

"""Checksums of a finished visit's files, as ``sha256sum --check`` reads them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from ikns.errors import FileError, unreadable

#: Name of the file.
SUMS = "sums.sha256"


def sums_bytes(files: Mapping[str, bytes]) -> bytes:
    r"""Return the checksums of files by their names in the visit's folder.

    >>> sums_bytes({"a": b""}).split()[0][:8], sums_bytes({"a": b""})[-4:]
    (b'e3b0c442', b'  a\n')
    """
    lines = (
        f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files)
    )
    return "".join(lines).encode()


def check_sums(visit: Path) -> bool:
    """Check that every file of a visit is as it was written.

    Returns
    -------
    bool
        False when the visit has no checksums: it is recorded attempt by attempt, or of
        a version that wrote none.

    Raises
    ------
    FileError
        Names the first file that is missing, has other bits, or holds attempts without
        having been written with the others.
    """
    file = visit / SUMS
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except FileNotFoundError:
        return False
    except OSError as error:
        raise unreadable(file, error) from None
    except UnicodeDecodeError:
        lines = [""]
    names = {line.partition("  ")[2] for line in lines}
    for path in sorted(visit.glob("[!.]*.parquet")):
        if path.name not in names:
            raise FileError(f"{path}: expected only what {SUMS} names, found one more.")
    for line in lines or [""]:
        digest, _, name = line.partition("  ")
        if len(digest) != 64 or not name or Path(name).is_absolute():
            raise FileError(f"{file}: cannot be read as checksums.")
        path = visit / name
        try:
            found = hashlib.sha256(path.read_bytes()).hexdigest()
        except FileNotFoundError:
            raise FileError(f"{visit}: {name} is missing.") from None
        except OSError as error:
            raise unreadable(path, error) from None
        if found != digest:
            size = path.stat().st_size
            raise FileError(
                f"{path}: expected the bits that were written, found "
                f"{f'{size} bytes with others' if size else 'an empty file'}."
            )
    return True

"""Where the real recordings are, and a reason to skip where they are not."""

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
DATA = Path(os.environ.get("IKNS_TEST_DATA", _BESIDE))


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of real recordings."""
    if not DATA.is_dir():
        pytest.skip(f"real recordings are not at {DATA}; set IKNS_TEST_DATA")
    return DATA

"""Recordings for the tests, real and simulated; in CI nothing may be skipped."""

import gc
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import small_person
from hypothesis import settings

# A kernel compiles in its first example, which then takes seconds.
settings.register_profile("ikns", deadline=None)
settings.load_profile("ikns")

# A shell starts what it puts into the background deaf to Ctrl-C, nohup to the end of
# the terminal, and so would be every program that a test starts and interrupts.
for number, usual in (
    (signal.SIGINT, signal.default_int_handler),
    (signal.SIGHUP, signal.SIG_DFL),
    (signal.SIGQUIT, signal.SIG_DFL),
):
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, usual)

# Modules and tests stay to the end: collecting garbage looks at them no more. Looking
# at them again and again took a seventh of the time.
gc.disable()


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


_leave = subprocess.Popen.__exit__


def _leave_killed(self: Any, kind: Any, *more: Any) -> None:
    """A test that fails does not wait for the program that it started."""
    if kind is not None:
        self.kill()
    _leave(self, kind, *more)


subprocess.Popen.__exit__ = _leave_killed  # type: ignore[method-assign]

_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
DATA = Path(os.environ.get("IKNS_TEST_DATA", _BESIDE))


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of real recordings."""
    if not DATA.is_dir():
        pytest.skip(f"real recordings are not at {DATA}; set IKNS_TEST_DATA")
    return DATA


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``static.c3d``, ``points.c3d``, ``free.c3d`` and the folder ``person``."""
    folder = tmp_path_factory.mktemp("files")
    run = small_person.protocol()
    for trial in run.trials:
        small_person.write(folder, trial.name, trial.recording)
    small_person.subject().save(folder / "person")
    return folder


@pytest.fixture(scope="module")
def browser_arguments() -> list[str]:
    from ikns.view.scene.picture import browser_options

    return browser_options()


@pytest.fixture(scope="module")
def chromium(browser_arguments: list[str]) -> Iterator[Any]:
    """A browser without a window, driven by playwright."""
    from playwright.sync_api import sync_playwright

    from ikns.view.scene.picture import HOW_TO_GET_ONE, find_browser

    browser = find_browser()
    if browser is None:
        pytest.skip(HOW_TO_GET_ONE)
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=browser, args=browser_arguments
        )
        yield chromium
        chromium.close()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail where ``CI`` is set and a test was skipped."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if os.environ.get("CI") and reporter and reporter.stats.get("skipped"):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED

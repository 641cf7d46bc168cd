"""Which systems have wheels for everything that ikns needs, by asking PyPI through pip.

For each system the whole tree of the base dependencies, and of the extras of the live
chain, is resolved with wheels only; nothing is installed or built. "pure" is a wheel
for any system, which holds no compiled code. Needs the network, so it is not in CI. pip
takes markers such as ``sys_platform`` from the machine that it runs on, whatever the
system asked for.

    python benchmarks/outside/platforms.py [--python 3.12] [--json]
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
_GLIBC = ("2_28", "2_27", "2_26", "2_24", "2_17", "2_12", "2_5")


def _linux(machine: str) -> list[str]:
    old = ["manylinux2014", *(["manylinux2010"] if machine == "x86_64" else [])]
    names = [*(f"manylinux_{version}" for version in _GLIBC), *old]
    return [f"{name}_{machine}" for name in names]


def _macos(machine: str) -> list[str]:
    older = [f"macosx_{version}_0" for version in range(14, 10, -1)]
    if machine == "x86_64":
        older += [f"macosx_10_{version}" for version in range(16, 8, -1)]
    return [f"{name}_{kind}" for name in older for kind in (machine, "universal2")]


#: Tags of wheels that a system takes, newest first. Raspberry Pi OS 64 bit, Ubuntu and
#: Debian on a Jetson or Pi are Linux aarch64.
SYSTEMS = {
    "Linux x86_64": _linux("x86_64"),
    "Linux aarch64": _linux("aarch64"),
    "macOS 14 arm64": _macos("arm64"),
    "macOS 14 x86_64": _macos("x86_64"),
    "Windows x64": ["win_amd64"],
}
#: Extras that a live chain may need.
EXTRAS = ("lsl", "optitrack", "qualisys", "serial", "xdf")


def resolved(wanted: list[str], system: str, python: str) -> dict[str, str] | str:
    """Return the versions of the whole tree, or the line in which pip says why not."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        words = ["install", "--quiet", "--dry-run", "--ignore-installed", "--target"]
        words += [folder, "--report", str(report), "--only-binary=:all:"]
        words += ["--python-version", python, "--implementation", "cp"]
        words += [f"--platform={tag}" for tag in SYSTEMS[system]]
        done = subprocess.run(
            [sys.executable, "-m", "pip", *words, *wanted],
            capture_output=True,
            text=True,
        )
        if done.returncode:
            errors = [x for x in done.stderr.splitlines() if x.startswith("ERROR")]
            return (errors or ["ERROR: pip failed"])[-1].removeprefix("ERROR: ")
        found = json.loads(report.read_text("utf-8"))["install"]
    return {_plain(one["metadata"]["name"]): _wheel(one) for one in found}


def _wheel(one: dict) -> str:
    pure = one["download_info"]["url"].endswith("-none-any.whl")
    return one["metadata"]["version"] + (" pure" if pure else "")


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[<>=!~;\[ ]", name)[0]).lower()


def column(wanted: list[str], system: str, python: str) -> dict[str, str]:
    """Return a version for each requirement, or why there is none."""
    whole = resolved(wanted, system, python)
    if isinstance(whole, dict):
        return {one: whole[_plain(one)] for one in wanted}
    answers = {one: resolved([one], system, python) for one in wanted}
    return {
        one: found[_plain(one)] if isinstance(found, dict) else f"none ({found})"
        for one, found in answers.items()
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default="3.11", help="Version of Python.")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if isinstance(resolved(["packaging"], "Linux x86_64", options.python), str):
        sys.exit("this asks PyPI through pip, which does not answer; it was not run.")
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *(x for name in EXTRAS for x in extras[name])]
    table = {system: column(wanted, system, options.python) for system in SYSTEMS}
    if options.json:
        print(json.dumps(table, indent=1))
        return
    print(f"Wheels for Python {options.python}\n")
    print("| needed | " + " | ".join(table) + " |")
    print("| --- |" + " --- |" * len(table))
    for one in wanted:
        cells = (column[one].split(" (")[0] for column in table.values())
        print(f"| {one} | " + " | ".join(cells) + " |")
    print()
    for system, found in table.items():
        for one, answer in found.items():
            if answer.startswith("none"):
                print(f"{system}: {one}: {answer}")


if __name__ == "__main__":
    main()

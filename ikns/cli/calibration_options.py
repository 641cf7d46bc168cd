"""Which options of ``ikns calibrate`` go together."""

from __future__ import annotations

from collections.abc import Iterable

import typer

from ikns.errors import InvalidInput

#: Options of files only.
_FILES_ONLY = (
    "static",
    "exploration",
    "subject_prefix",
    "rename",
    "labels",
    "cutoff",
    "from_",
    "to",
)
#: Options of a live calibration only.
_LIVE_ONLY = (
    "source",
    "recordings",
    "static_seconds",
    "free_seconds",
    "natural_seconds",
    "point_seconds",
    "countdown",
    "resume",
    "auto",
)
#: What --rewear takes of the options above.
_REWEAR = {
    *("rewear", "subject", "static", "natural", "out", "marker_set", "min_static"),
    *("force", "as_json", "subject_prefix", "rename", "labels", "cutoff"),
}


def check_options(
    context: typer.Context, *, live: bool, rewear: bool, short: bool
) -> set[str]:
    """Check that options go together; return those that were given."""
    given = {
        name
        for name in context.params
        if (origin := context.get_parameter_source(name)) and origin.name != "DEFAULT"
    }

    def options(names: Iterable[str]) -> str:
        return " and ".join(f"--{name.rstrip('_').replace('_', '-')}" for name in names)

    if rewear:
        if other := [name for name in context.params if name in given - _REWEAR]:
            raise InvalidInput(
                f"{options(other)} {'does' if len(other) == 1 else 'do'} not combine "
                "with --rewear, which keeps what was learned."
            )
        wanted = [n for n in ("subject", "static", "natural") if n not in given]
        if wanted:
            raise InvalidInput(f"--rewear needs {options(wanted)} too.")
        return given
    if "subject" in given:
        raise InvalidInput("--subject needs --rewear.")
    if live:
        files = [name for name in _FILES_ONLY if name in given]
        if files:
            raise InvalidInput(
                f"{options(files)} {'goes' if len(files) == 1 else 'go'} with "
                "recordings from files, and --live records them; give one or the other."
            )
        if "source" not in given:
            raise InvalidInput("--live needs the --source of the markers.")
        return given
    alone = [name for name in _LIVE_ONLY if name in given]
    if alone:
        raise InvalidInput(f"{options(alone)} needs --live.")
    missing = [] if "exploration" in given else ["--exploration"]
    if not given & {"static", "stature"}:
        missing.insert(0, "--static (or --stature, --mass and --sex)")
    if short and "natural" not in given:
        missing.append("--natural, 20 s of ordinary movement, for --short")
    if missing:
        raise InvalidInput(
            f"expected {' and '.join(missing)}, or --live with a --source."
        )
    return given

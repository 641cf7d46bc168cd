"""Options of ``ikns calibrate``: which go together, and what they mean."""

from __future__ import annotations

from collections.abc import Container, Iterable

import typer

import ikns
from ikns.body.chain import ChainLike
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


def chain_of(
    name: str | None, side: str, *, clavicle: bool, given: Container[str]
) -> ChainLike:
    """Return the chain that --chain, --side and --clavicle ask for."""
    if name is not None:
        if "side" in given or clavicle:
            raise InvalidInput("--chain says the joints; leave out --side, --clavicle.")
        from ikns.body.chain_files import load_chain, shipped_chains

        return name if name in shipped_chains() else load_chain(name)
    if side != "both":
        return f"{side}_arm" + "_clavicle" * clavicle
    if clavicle:
        raise InvalidInput("--clavicle works with --side right or left, not with both.")
    return "both_arms"


def lengths_of(
    values: tuple[int, float, float], given: Container[str], *, live: bool, short: bool
) -> tuple[int, float, float]:
    """Points, and seconds of the static trial and of free exploration."""
    points, static, free = values
    if short:
        return (
            points if "points" in given else 2,
            static if "static_seconds" in given else 3.0,
            free if "free_seconds" in given else 0.0,
        )
    if live and not free > 0:
        raise InvalidInput(
            f"expected --free-seconds above 0 s, found {free:g} s; only --short works "
            "without free exploration."
        )
    return values


def body_of(
    stature: float | None, mass: float | None, sex: str | None
) -> ikns.Skeleton | None:
    """Return a body from anthropometry; None without any of the three."""
    if stature is not None and mass is not None and sex is not None:
        return ikns.Skeleton.from_anthropometry(stature, mass, sex)
    options = {"--stature": stature, "--mass": mass, "--sex": sex}
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InvalidInput(
            "expected --stature, --mass and --sex together or none of them, found "
            f"only {' and '.join(given)}."
        )
    return None

"""What a wrong command line is told: what was expected, and what was found."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from itertools import pairwise
from typing import Any, get_args, get_origin

import typer


def usage_sentence(error: typer.TyperException, argv: Sequence[str]) -> str:
    """Say what is wrong with a command line; empty where the help was printed.

    Typer's own words are those of Python: *input should be a valid integer, unable to
    parse string as an integer*.
    """
    message = error.format_message().rstrip(".")
    if not message:
        return ""
    return f"{_wrong_value(error, argv) or _wrong_words(error, message, argv)}."


def _wrong_words(error: typer.TyperException, message: str, argv: Sequence[str]) -> str:
    """Say which words of the line are too many, unknown or missing, and where to look.

    Typer tells its errors apart by classes that it keeps to itself, so by their names.
    """
    context, kind = getattr(error, "ctx", None), type(error).__name__
    command = " ".join(["ikns", *argv[:1]])  # where typer does not say it
    command = command if context is None else str(context.command_path)
    option = getattr(error, "option_name", "")
    parts = context.command.params if context else []
    if kind == "NoSuchOption":
        options = [name for part in parts for name in part.opts]
        meant = " or ".join(get_close_matches(option, options, n=2, cutoff=0.7))
        message = f"`{command}` has no option {option}"
        message += f" (did you mean {meant}?)" if meant else ""
    elif kind == "MissingParameter":
        message = f"{name_of(error.param)} is required"  # type: ignore[attr-defined]
    elif option and message.endswith("requires an argument"):
        message = f"{option} needs a value"
    elif option and message.endswith("does not take a value"):
        message = f"{option} takes no value"
    elif message.startswith("No such command"):
        return _unknown_command(message, context, command)
    elif message.startswith("Got unexpected extra argument"):
        words = message.partition("(s) (")[2].removesuffix(")")
        known = " and ".join(map(name_of, filter(_is_argument, parts)))
        message = f"expected {known or 'options'} only, found also {words}"
    return f"{message}; see `{command} --help`"


def _unknown_command(message: str, context: Any, command: str) -> str:
    """Say which commands there are, and which one is probably meant.

    Typer's words are *No such command 'chek'. Did you mean 'check'?*
    """
    known = list(context.command.commands) if context else []
    word = message.removeprefix("No such command ").partition(". Did you")[0]
    word = word.strip("'\"")
    meant = " or ".join(f"'{each}'" for each in get_close_matches(word, known, n=2))
    advice = f"did you mean {meant}? See" if meant else "see"
    return (
        f"expected a command ({', '.join(known)}), found '{word}'; {advice} "
        f"`{command} --help`"
    )


def _wrong_value(error: typer.TyperException, argv: Sequence[str]) -> str:
    """Say which values an option takes and which it got; empty if it got none."""
    part = getattr(error, "param", None)
    if part is None or type(error).__name__ == "MissingParameter":
        return ""
    found = ""
    for option, value in pairwise([*argv, ""]):
        name, equals, rest = option.partition("=")
        if name in part.opts:
            found = rest if equals else value
    expected = _expected(part)
    return f"expected {expected} for {name_of(part)}, found {found}" if expected else ""


def _expected(part: Any) -> str:
    """Return the values that an option takes, in words; empty for any text."""
    if choices := part.type_descriptor.choices:
        *rest, last = map(str, choices)
        return f"{', '.join(rest)} or {last}" if rest else last
    kind = kind_of(part)
    if kind not in (int, float):
        return ""
    least, most = (getattr(part, name, None) for name in ("min", "max"))
    bounds = [("from", least), ("up to" if least is None else "to", most)]
    words = ["a whole number" if kind is int else "a number"]
    words += [f"{word} {bound:.12g}" for word, bound in bounds if bound is not None]
    return " ".join(words)


def kind_of(part: Any) -> Any:
    """Return the type of each value of an argument or option."""
    kind = part.type_descriptor.annotation
    return get_args(kind)[0] if get_origin(kind) is list else kind


def name_of(part: Any) -> str:
    """Return the name of an argument or option as the help shows it."""
    return str(part.metavar if _is_argument(part) else part.opts[-1])


def _is_argument(part: Any) -> bool:
    return bool(part.param_type_name == "argument")

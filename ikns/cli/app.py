"""The commands; every error becomes one sentence and exit code 2."""

from __future__ import annotations

import contextlib
import functools
import importlib
import signal
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer

import ikns
from ikns.cli.checks import checked
from ikns.cli.output import erase_loading
from ikns.cli.repairs import repairs, tell
from ikns.cli.usage import kind_of, usage_sentence
from ikns.endings import BROKEN_PIPE, signal_exit_code
from ikns.errors import DataLoss, InvalidInput, plain

#: Commands by what they are for, in the order of the help.
_GROUPS = {
    "Start here": ("demo", "docs"),
    "Recordings and bodies": ("check", "scale", "ik", "convert", "markers"),
    "Null space": ("calibrate", "control", "compare", "ucm", "view", "robot"),
    "Live": ("run", "replay"),
    "Experiments": ("track", "pick", "study", "report"),
    "Desk tools": ("stream", "servo"),
}
_COMMANDS = {name: group for group, names in _GROUPS.items() for name in names}
#: What the help calls the values of an option.
_VALUES = {bool: "", int: "INTEGER", float: "NUMBER", str: "TEXT", Path: "PATH"}
#: Files of commands that are not called like them.
_FILES = {"report": "study_report"}


def make_app(*names: str) -> typer.Typer:
    """Return the application with these commands, by default with all.

    Who runs one command does not wait until the files of all are imported.
    """
    app = typer.Typer(
        name="ikns",
        help="Learn a person's kinematic null space and turn it into a control signal.",
        no_args_is_help=True,
    )
    app.callback()(_options)
    for name in names or _COMMANDS:
        file = importlib.import_module(f"ikns.cli.{_FILES.get(name, name)}")
        if group := getattr(file, f"{name}_app", None):
            app.add_typer(group, name=name, rich_help_panel=_COMMANDS[name])
        else:
            command = checked(getattr(file, name))
            app.command(rich_help_panel=_COMMANDS[name])(command)
    return app


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ikns {ikns.__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, help="Print the version.")
    ] = False,
) -> None: ...


def run_command(argv: Sequence[str] | None = None) -> int:
    """Run one command; :func:`ikns.cli.main` handles the signals around it.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        0 on success, 1 when something recorded is not on disk, 2 on bad input, 3 when a
        finger was never active or ended in its safe state, 128 + n when signal n ended
        the command.
    """
    given = list(sys.argv[1:] if argv is None else argv)
    with repairs() as repaired:
        code = _run(given)
    if code != 2:  # bad input: one sentence
        tell(repaired)
    return code


def _run(given: list[str]) -> int:
    try:
        _refuse_empty(given)
        # Not standalone: typer then raises errors instead of printing several lines.
        code = command_parser(*(name for name in given[:1] if name in _COMMANDS)).main(
            args=_repeat("--exploration", given),
            prog_name="ikns",
            standalone_mode=False,
        )
    except typer.TyperException as error:  # such as an unknown option
        message = usage_sentence(error, given)
        if not message:  # no arguments at all: the help was printed
            return 2
    except DataLoss as error:
        sys.stderr.write(f"ikns: {' '.join(str(error).split())}\n")
        return 1
    except ikns.IknsError as error:
        message = str(error)
    except BrokenPipeError:
        return BROKEN_PIPE
    except OSError as error:
        name = error.filename
        where = "" if name is None else f"{name}: cannot be read or written: "
        message = f"{where}{plain(error)}."
    except typer.Abort:
        return signal_exit_code() or 128 + signal.SIGINT
    else:
        return code or 0
    # The terminal may be gone.
    with contextlib.suppress(OSError):
        erase_loading()
        sys.stderr.write(f"ikns: {' '.join(message.split())}\n")
    return 2


@functools.cache
def command_parser(*names: str) -> Any:
    """Return the parser of commands, by default of all; built once for all calls."""
    parser = typer.main.get_command(make_app(*names))
    _name_values(parser)
    return parser


def _name_values(command: Any) -> None:
    """Name what a command takes as people do: NUMBER, RECORDING, not <float range>."""
    for part in getattr(command, "commands", {}).values():
        _name_values(part)
    # Lines of a docstring are not those of a terminal.
    paragraphs = (command.help or "").split("\n\n")
    command.help = "\n\n".join(" ".join(text.split()) for text in paragraphs)
    for part in command.get_params(typer.Context(command)):  # --help too
        if part.metavar is None:
            part.metavar = _value_name(part)
        if part.param_type_name == "argument":
            part.display_type_rich = lambda **_: ""  # its help says what it is
        # Ranges leave no room for words; who is beyond one is told it.
        part._get_number_range_help_str = lambda: None
        if isinstance(part.show_default, str):  # typer puts it in parentheses
            part._get_default_string = functools.partial(_told_default, part)


def _told_default(part: Any, **_: Any) -> str:
    return str(part.show_default)


def _value_name(part: Any) -> str:
    """Name what an argument or option takes."""
    if part.param_type_name == "argument":
        return str(part.name).upper()
    if choices := part.type_descriptor.choices:
        return "|".join(map(str, choices))
    return _VALUES[kind_of(part)]


def _refuse_empty(argv: Sequence[str]) -> None:
    """Refuse an empty value: as the name of a file it would mean the folder here."""
    for before, argument in pairwise(["", *argv]):
        option, equals, value = argument.partition("=")
        named = before
        if equals and option.startswith("--"):
            named, argument = option, value
        if not argument:
            where = f"for {named}" if named.startswith("--") else "as an argument"
            raise InvalidInput(f"expected a value {where}, found an empty one.")


def _repeat(option: str, argv: Sequence[str]) -> list[str]:
    """Repeat an option before each of its values, as typer expects.

    >>> _repeat("--of", ["--of", "a", "b", "--to", "c"])
    ['--of', 'a', '--of', 'b', '--to', 'c']
    """
    repeated: list[str] = []
    values = False
    for argument in argv:
        if argument.startswith("-"):
            values = argument == option
        elif values and repeated[-1] != option:
            repeated.append(option)
        repeated.append(argument)
    return repeated

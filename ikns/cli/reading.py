"""Options of all commands that read marker files, and the reading itself."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

import ikns
from ikns.calibration.subject_files import check_subject_folder
from ikns.cli.options import LabelFile, Rename, SubjectPrefix
from ikns.cli.output import loading
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.output.inputs import refuse_input, refuse_input_folder
from ikns.recording.part import require_rate

#: What a command calls to read a marker file, with ``start`` and ``end`` of
#: :func:`ikns.read` if it likes; it returns the recording.
Read = Callable[..., Any]

#: Options of these commands that name something to write.
_OUTPUTS = ("out", "png", "animation", "figure", "rrd")
#: Options and arguments that are recordings.
_RECORDINGS = (
    *("recording", "recordings", "static", "exploration", "natural", "movement"),
    "reaches",
)
_OPTIONS = {
    "subject_prefix": (SubjectPrefix, None),
    "rename": (Rename, None),
    "labels": (LabelFile, None),
    "cutoff": (
        Annotated[
            float | None,
            typer.Option(
                help="Cutoff of a low-pass filter on positions, Hz; 4 to 8 for "
                "keypoints.",
                min=0.0,
                max=1000.0,
            ),
        ],
        None,
    ),
}

_RenameAll = Annotated[
    list[str] | None,
    typer.Option(
        "--rename",
        metavar="OLD=NEW",
        help="Read marker OLD as NEW, in every recording, --static too. Repeat for "
        "more markers.",
    ),
]


def reads_markers(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options to a command that takes a parameter ``read``.

    The command calls ``read(path)`` instead of :func:`ikns.read`. Labels of
    ``--rename`` that no file has are refused before it begins.
    """
    own = signature(command, eval_str=True)
    parameters = [p for p in own.parameters.values() if p.name != "read"]
    place = next(
        (k for k, p in enumerate(parameters) if p.name in ("force", "as_json")),
        len(parameters),
    )
    parameters[place:place] = [
        Parameter(
            name, Parameter.POSITIONAL_OR_KEYWORD, default=default, annotation=kind
        )
        for name, (kind, default) in _options(own).items()
    ]

    @_static_too
    @wraps(command)
    def run(**values: Any) -> None:
        given = {name: values.pop(name, None) for name in _OPTIONS}
        _keep(given["labels"], values)
        names = label_names(given["rename"], given["labels"])
        prefix = given["subject_prefix"]
        refuse_unused(given["rename"], _recordings(values), subject_prefix=prefix)

        def read(path: Path, **part: Any) -> ikns.Recording:
            recording = ikns.read(path, subject_prefix=prefix, **part)
            require_rate(
                recording, part=any(each is not None for each in part.values())
            )
            if names:
                from ikns.recording.labels import renamed

                recording = renamed(recording, names)
            if given["cutoff"] is not None:
                from ikns.recording.low_pass import low_pass

                recording = low_pass(recording, given["cutoff"])
            return recording

        command(read=read, **values)

    # Typer reads the options from here, and no one from the command below.
    del run.__wrapped__
    run.__signature__ = own.replace(parameters=parameters)
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def _options(own: Signature) -> dict[str, Any]:
    """Return the options that a command with this signature gets."""
    static = own.parameters.get("static")
    as_option = static is not None and static.default is None
    return _OPTIONS | ({"rename": (_RenameAll, None)} if as_option else {})


def _static_too(run: Callable[..., None]) -> Any:
    """Say in an error that a static trial beside the recordings was renamed too."""

    @wraps(run)
    def renaming(**values: Any) -> None:
        try:
            run(**values)
        except ikns.IknsError as error:
            names = ("recording", "recordings", "exploration")
            beside = any(values.get(name) for name in names)
            if not beside or values.get("static") is None:
                raise
            if not (values.get("rename") or values.get("labels")):
                raise
            told = f"{str(error).rstrip('.')}; --rename and --labels apply to --static"
            raise type(error)(f"{told} too.") from None

    return renaming


def check_inputs(
    recordings: Iterable[Path | None], subject: Path | None = None
) -> None:
    """Refuse what is not there, before the imports that take a while.

    Raises
    ------
    FileError
        As whoever reads the recordings and the subject folder does.
    """
    from ikns.recording.files import check_marker_file

    if subject is not None:
        check_subject_folder(subject)
    for path in recordings:
        if path is not None:
            check_marker_file(path)
    loading()


def refuse_repeated(recordings: Iterable[Path], where: str = "") -> None:
    """Refuse a recording given twice, which would count twice; `where` is the option.

    Raises
    ------
    InvalidInput
        When two paths lead to the same file.
    """
    seen: set[Path] = set()
    for path in recordings:
        if path.resolve() in seen:
            raise InvalidInput(
                f"{path}: given twice{f' for {where}' * bool(where)}; give each "
                "recording once."
            )
        seen.add(path.resolve())


def _keep(labels: Path | None, values: dict[str, Any]) -> None:
    """Refuse to write over the file with the labels."""
    for name in _OUTPUTS if labels is not None else ():
        given = values.get(name) or []
        for output in given if isinstance(given, list) else [given]:
            refuse = refuse_input_folder if output.is_dir() else refuse_input
            refuse(output, [labels])


def label_names(
    rename: list[str] | None, labels: Path | None, source: str | None = None
) -> dict[str, str]:
    """Return the new label of each old one of --rename and --labels.

    Where `source` replays recordings, they must have the labels of --rename.
    """
    if not rename and labels is None:
        return {}
    if source is not None:
        from ikns.calibration.simulated import played_files

        refuse_unused(rename, played_files(source))
    from ikns.recording.labels import name_pairs, read_name_pairs

    names = {} if labels is None else read_name_pairs(labels)
    return names | name_pairs(rename or [], where="--rename")


def refuse_unused(
    rename: list[str] | None, recordings: Iterable[Path], **how: Any
) -> None:
    """Refuse labels of --rename that none of the recordings has.

    One that cannot be read is left to the command, which says what is wrong with it.
    `how` is that of :func:`ikns.read`.

    Raises
    ------
    MarkerMismatch
        With the labels, and a few of those that there are.
    """
    if not rename:
        return
    from ikns.recording.labels import name_pairs, unused_names

    names = name_pairs(rename, where="--rename")
    seen: list[str] = []
    for path in recordings:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                seen += ikns.read(path, **how).labels
        except (ikns.IknsError, OSError):
            return
    if seen and (lost := unused_names(seen, names)):
        known = ", ".join(dict.fromkeys(seen[:6]))
        raise MarkerMismatch(
            f"no recording has the label {', '.join(lost)} of --rename; there are "
            f"{known} and so on."
        )


def _recordings(values: dict[str, Any]) -> list[Path]:
    """Return the marker files among the values of a command."""
    given = [values.get(name) for name in _RECORDINGS]
    lists = [each if isinstance(each, list) else [each] for each in given]
    return [path for each in lists for path in each if path is not None]

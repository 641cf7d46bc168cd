"""Open live sources by address."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from urllib.parse import parse_qsl

from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.finding import refused
from ikns.calibration.judge.labels import judge_labels
from ikns.calibration.subject import Subject
from ikns.errors import IknsError, InvalidInput, MarkerMismatch
from ikns.finger.ros2.address import OPTIONS as ROS_OPTIONS
from ikns.finger.ros2.address import ros_address
from ikns.live.stream.frame import Feed
from ikns.live.stream.lsl_feed import LslFeed
from ikns.live.stream.lsl_search import Wanted
from ikns.live.stream.renamed import RenamedFeed
from ikns.live.stream.replay import Replay
from ikns.live.stream.ros import RosFeed
from ikns.live.stream.sides_check import check_sides
from ikns.live.stream.size_check import check_size, first_frames
from ikns.live.stream.source import Source
from ikns.live.stream.subjects import SubjectFeed, check_one_subject, subjects_of
from ikns.recording.files import read

_KNOWN = "replay:FILE, lsl:NAME, qualisys:HOST, vicon:HOST, natnet:HOST or ros2:TOPIC"
#: So many frames of a recording show the size of the body, and which side is which.
_GLANCES = 1000

Options = dict[str, str]
Names = Mapping[str, str] | None


def open_source(
    address: str,
    *,
    needs: MarkerSet | None = None,
    subject: Subject | None = None,
    names: Names = None,
    read_timeout: float = 10.0,
    late_after: float | None = None,
) -> Source:
    """Open a live source.

    Parameters
    ----------
    address : str
        ``replay:FILE`` (``?speed=2``, ``?speed=max`` for as fast as frames are read,
        ``?loop=yes``), ``lsl:NAME`` (``?scope=machine`` for streams of this machine
        only, ``?source_id=ID`` and ``?host=HOST`` for one of several streams of that
        name, ``?unit=mm``, cm or m for positions whose description names no unit or a
        wrong one), ``qualisys:HOST``, ``vicon:HOST``, or ``natnet:HOST`` for OptiTrack
        (also ``HOST:PORT``), or ``ros2:TOPIC`` for ``mocap4r2_msgs/msg/Markers``
        (``?router=HOST:PORT``, 127.0.0.1:7447 by default, ``?domain=NUMBER``, and
        ``?rate=FRAMES`` where stamps are too uneven to show it). All take
        ``?subject=NAME`` for one of several subjects (``NAME:RSHO`` or ``NAME_RSHO``),
        and all but a replay ``?timeout=SECONDS``; options are joined by ``&``.
    needs : MarkerSet, optional
        All its markers except static-only ones must be among the labels, of one
        subject.
    subject : Subject, optional
        Who is tracked: like `needs` with its marker set, and distances within segments
        must not be ten times or a tenth of those at calibration. The frames of a live
        source used for this check are not returned again. A recording must not have
        left and right swapped.
    names : mapping, optional
        Other labels for markers of the source, new by old, as for
        :func:`ikns.recording.labels.renamed`.
    read_timeout : float
        Iterating raises an error after this time without a frame, s.
    late_after : float, optional
        Delay from which a frame counts as late, s; one frame period by default.

    Returns
    -------
    Source

    Raises
    ------
    InvalidInput
        When the address is wrong.
    FileError
        When the file is not a recording.
    StreamError
        When the source does not answer, is of the wrong kind, or is one of several
        that the address could mean; an LSL stream is searched for one second longer
        than until the first answers. Also for a body of another size than `subject`.
    MarkerMismatch
        When a marker of `needs` is missing, or they are those of several subjects, or
        left and right are swapped in a recording.

    Examples
    --------
    >>> import tempfile
    >>> from ikns.recording.files import write_c3d
    >>> from ikns.recording.recording import Recording
    >>> recording = Recording([0.0, 0.01], [[[0.1, 0.2, 0.3]]] * 2, ["C7"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_c3d(f"{folder}/trial.c3d", recording)
    ...     with open_source(f"replay:{folder}/trial.c3d?speed=max") as source:
    ...         print(source.labels, [frame.number for frame in source])
    ('C7',) [0, 1]
    """
    scheme, colon, rest = address.partition(":")
    place, _, query = rest.rpartition("?") if "?" in rest else (rest, "", "")
    kind = _KINDS.get(scheme) if colon else None
    if kind is None:
        meant = "; to play this file, write replay: before it" * _is_file(address)
        raise InvalidInput(f"unknown source '{address}', expected {_KNOWN}{meant}.")
    open_feed, options_known = kind
    options = dict(parse_qsl(query, keep_blank_values=True))
    for option in options:
        if option not in options_known:
            raise InvalidInput(
                f"{address}: unknown option '{option}', expected "
                f"{' or '.join(options_known)}."
            )
    if not place and scheme != "lsl":
        raise InvalidInput(f"{address}: expected {_KNOWN}.")
    try:
        feed = open_feed(place, options)
    except IknsError as error:
        if str(error).startswith(tuple(filter(None, (f"{scheme}:", place)))):
            raise
        raise type(error)(f"{address}: {error}") from None
    try:
        chosen = _chosen(feed, options, names)
        worn = subject.skeleton.marker_set if subject else needs
        if worn is not None:
            _check_labels(chosen, worn.without_static())
        if subject is not None:
            _check_body(feed, options, names, subject)
        return Source(chosen, read_timeout=read_timeout, late_after=late_after)
    except BaseException:
        feed.close()
        raise


def _chosen(feed: Feed, options: Options, names: Names) -> Feed:
    """Return one subject of a feed, renamed."""
    if "subject" in options:
        feed = SubjectFeed(feed, options["subject"])
    return RenamedFeed(feed, names) if names else feed


def _check_labels(source: Feed, needs: MarkerSet) -> None:
    check_one_subject(source.name, source.labels, needs)
    columns = needs.columns(source.labels)
    missing = [label for label, c in zip(needs.labels, columns, strict=True) if c < 0]
    if missing:
        others = judge_labels(source.name, source.labels, needs, calibrated=True)
        if faults := refused(others):
            raise MarkerMismatch(faults[0].sentence)
        hint = "".join(
            f"; those of {name} are read with the option subject, as in ?subject={name}"
            for name in subjects_of(source.labels, needs)
        )
        raise MarkerMismatch(
            f"{source.name}: expected markers {', '.join(missing)}, found only "
            f"{', '.join(source.labels)}{hint}."
        )


def _check_body(feed: Feed, options: Options, names: Names, subject: Subject) -> None:
    if isinstance(feed, Replay):  # looked at without starting its clock
        again = _chosen(Replay(feed.recording, speed=0), options, names)
        markers, labels = first_frames(again, _GLANCES), again.labels
        check_sides(feed.recording, labels, markers[1:], subject)
    else:
        chosen = _chosen(feed, options, names)
        markers, labels = first_frames(chosen), chosen.labels
    unit = feed.meters_per_unit if isinstance(feed, LslFeed) else math.nan
    check_size(feed.name, labels, markers, subject, meters_per_unit=unit)


def _replay(path: str, options: Options) -> Feed:
    speed = options.get("speed", "1")
    loop = options.get("loop", "no")
    if loop not in ("", "yes", "no"):
        raise InvalidInput(f"expected loop=yes or loop=no, found loop={loop}.")
    return Replay(
        read(path),
        speed=0.0 if speed == "max" else _number("speed", speed),
        loop=loop != "no",
    )


def _lsl(stream: str, options: Options) -> Feed:
    scope = options.get("scope", "network")
    if scope not in ("machine", "network"):
        raise InvalidInput(f"expected scope=machine or network, found scope={scope}.")
    unit = options.get("unit")
    if unit is not None and unit not in ("mm", "cm", "m"):
        raise InvalidInput(f"expected unit=mm, cm or m, found unit={unit}.")
    return LslFeed(
        Wanted(stream, options.get("source_id"), options.get("host")),
        unit=unit,
        timeout=_timeout(options),
        this_machine=scope == "machine",
    )


def _qualisys(host: str, options: Options) -> Feed:
    from ikns.live.stream.qualisys import PORT, QualisysFeed

    return QualisysFeed(*_host(host, PORT), timeout=_timeout(options))


def _vicon(host: str, options: Options) -> Feed:
    from ikns.live.stream.vicon import PORT, ViconFeed

    return ViconFeed(*_host(host, PORT), timeout=_timeout(options))


def _natnet(host: str, options: Options) -> Feed:
    from ikns.live.stream.natnet import PORT, NatNetFeed

    return NatNetFeed(*_host(host, PORT), timeout=_timeout(options))


def _ros(topic: str, options: Options) -> Feed:
    rate = None
    if "rate" in options:
        rate = _number("rate", options["rate"])
        if not 0 < rate < 1e6:
            raise InvalidInput(f"expected a rate above 0 frames/s, found {rate:g}.")
    address = ros_address(topic, options)
    return RosFeed(address, timeout=_timeout(options), rate=rate)


_KINDS: dict[str, tuple[Callable[[str, Options], Feed], tuple[str, ...]]] = {
    "replay": (_replay, ("speed", "loop", "subject")),
    "lsl": (_lsl, ("timeout", "scope", "source_id", "host", "unit", "subject")),
    "qualisys": (_qualisys, ("timeout", "subject")),
    "vicon": (_vicon, ("timeout", "subject")),
    "natnet": (_natnet, ("timeout", "subject")),
    "ros2": (_ros, (*ROS_OPTIONS, "rate", "timeout", "subject")),
}


def _host(text: str, port: int) -> tuple[str, int]:
    """Split host and port; an IPv6 address with a port is in brackets.

    >>> _host("10.0.0.5", 801), _host("[fe80::1]:802", 801), _host("fe80::1", 801)
    (('10.0.0.5', 801), ('fe80::1', 802), ('fe80::1', 801))
    """
    host, colon, number = text.rpartition(":")
    bracketed = host.startswith("[") and host.endswith("]")
    if not colon or (":" in host and not bracketed):
        return text.strip("[]"), port
    if not (number.isascii() and number.isdigit() and 0 < int(number) < 65536):
        raise InvalidInput(f"expected a port from 1 to 65535, found '{number}'.")
    return host.strip("[]"), int(number)


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except OSError:  # too long for a name
        return False


def _timeout(options: Options) -> float:
    seconds = _number("timeout", options.get("timeout", "5"))
    if not 0 < seconds < 1e6:
        raise InvalidInput(f"expected a timeout above 0 s, found {seconds:g}.")
    return seconds


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidInput(f"expected a number for {name}, found '{text}'.") from None

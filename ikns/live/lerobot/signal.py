"""The live loop on its own thread, for a program that asks for the latest value."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ikns.calibration.subject import Subject
from ikns.calibration.subject_files import check_subject_folder
from ikns.errors import StreamError
from ikns.finger import Safety
from ikns.finger.relay import RelayFinger
from ikns.live.control.controller import Decision
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime.loop import run
from ikns.live.stream import open_source
from ikns.live.warm_up import warm_up

#: How long to wait for a first frame that counts, s.
_FIRST_TIMEOUT = 10.0
_NONE = "no frame arrived"


class LiveSignal:
    """c and flexion of a person, live: what ``ikns run`` does, for another program.

    The same loop runs, with the same gates and the same safety machine: a frame that
    does not count leaves flexion where it is, and so does its absence; after half a
    second of it flexion goes to its safe state, which is told and left only by
    :meth:`arm_again`. It commands a :class:`RelayFinger`, whose flexion is handed on.

    Parameters
    ----------
    subject : path
        Folder of a calibrated subject.
    source : str
        See :func:`ikns.live.stream.open_source`.
    settings : ControlSettings, optional
    safety : Safety, optional
        Safe state ``hold``, the default, or ``open``.
    tell : callable, optional
        Called with sentences, such as why flexion is in its safe state; from another
        thread, and must not wait.
    """

    def __init__(
        self,
        subject: str | Path,
        source: str,
        *,
        settings: ControlSettings | None = None,
        safety: Safety | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self._subject, self._address = Path(subject), source
        self._settings = ControlSettings() if settings is None else settings
        self._finger = RelayFinger(safety=safety)
        self._tell = tell
        self._thread: threading.Thread | None = None
        self._stop, self._arm = threading.Event(), threading.Event()
        self._ready = threading.Event()
        self._c, self._why = np.nan, _NONE
        self._error: BaseException | None = None

    @property
    def running(self) -> bool:
        """Whether the loop runs."""
        return self._thread is not None and self._thread.is_alive()

    def start(self) -> None:
        """Open the source and wait for a first frame that counts.

        Raises
        ------
        IknsError
            When subject or source cannot be opened, or no frame counts within 10 s.
        """
        check_subject_folder(self._subject)
        calibrated = Subject.load(self._subject)
        calibrated.readout(self._settings.method)  # before a source is opened
        for event in (self._stop, self._arm, self._ready):
            event.clear()
        self._c, self._why, self._error = np.nan, _NONE, None
        warm_up()
        self._thread = threading.Thread(
            target=self._run, args=(calibrated,), daemon=True, name="ikns"
        )
        self._thread.start()
        give_up = time.monotonic() + _FIRST_TIMEOUT
        try:
            while not self._ready.wait(0.05):
                if self._error is not None:
                    raise self._error
                if not self.running or time.monotonic() > give_up:
                    raise StreamError(
                        f"{self._address}: no frame counted: {self._why}."
                    )
        except BaseException:
            self.stop()
            raise

    def latest(self) -> tuple[float, float]:
        """Return c of the last frame that counted, and flexion now.

        Raises
        ------
        Exception
            What ended the loop, if it did not end in order.
        """
        if self._error is not None:
            raise self._error
        return self._c, self._finger.latest()

    def arm_again(self) -> None:
        """Leave the safe state, from the flexion it has and from rest."""
        self._arm.set()

    def stop(self) -> None:
        """End the loop and close the source; harmless when repeated."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _run(self, calibrated: Subject) -> None:
        try:
            with open_source(self._address, subject=calibrated) as source:
                run(
                    source,
                    calibrated,
                    self._finger,
                    settings=self._settings,
                    stop=self._stop,
                    arm=self._arm,
                    on_decision=self._take,
                    on_notice=self._tell,
                    exclusive=False,
                )
            if not self._stop.is_set() and self._tell:
                self._tell(f"{self._address} has ended; flexion stays where it is.")
        except BaseException as error:  # for who asks next
            self._finger.make_safe(f"{type(error).__name__} ended the loop")
            self._error = error

    def _take(self, received: float, flexion: float, decision: Decision) -> None:
        self._why = decision.rejection
        if decision.valid:
            self._c = float(decision.solved.c[0])
            self._ready.set()

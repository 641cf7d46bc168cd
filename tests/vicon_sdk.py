"""A stand-in for the vendor's ``vicon_dssdk.ViconDataStream``, with its call shape.

Names, arguments and results are those of the Python examples that come with the SDK.
"""

import enum
import queue
import threading


class DataStreamException(Exception):
    """What every call raises that fails."""


class Stage:
    """What the stand-in plays; a test sets it up before it connects."""

    def __init__(self) -> None:
        self.subjects: dict[str, list[str]] = {"Ann": ["RSHO", "RELB"]}
        self.rate = 100.0
        self.refuses = False
        self.frames: queue.Queue[tuple[int, dict[str, object]] | None] = queue.Queue()
        self.calls: list[str] = []
        self.hangs = threading.Event()
        self.hangs.set()


stage = Stage()


class Client:
    """The vendor's client."""

    class StreamMode(enum.Enum):
        EClientPull = 0
        EClientPullPreFetch = 1
        EServerPush = 2

    class AxisMapping(enum.Enum):
        EUp = 0
        EDown = 1
        ELeft = 2
        ERight = 3
        EForward = 4
        EBackward = 5

    def __init__(self) -> None:
        self._connected = self._markers = False
        self._mode = Client.StreamMode.EClientPull
        self._number = 0
        self._positions: dict[str, object] = {}

    def Connect(self, address: str) -> None:
        stage.calls.append(f"Connect {address}")
        stage.hangs.wait()
        if stage.refuses:
            raise DataStreamException("ClientConnectionFailed")
        self._connected = True

    def Disconnect(self) -> None:
        self._connected = False

    def IsConnected(self) -> bool:
        return self._connected

    def SetBufferSize(self, frames: int) -> None:
        assert frames > 0

    def EnableMarkerData(self) -> None:
        self._markers = True

    def SetStreamMode(self, mode: "Client.StreamMode") -> None:
        self._mode = Client.StreamMode(mode)

    def SetAxisMapping(self, *axes: "Client.AxisMapping") -> None:
        assert [axis.name for axis in axes] == ["EForward", "ELeft", "EUp"]

    def GetFrame(self) -> bool:
        if not self._connected:
            raise DataStreamException("NotConnected")
        assert self._mode is Client.StreamMode.EServerPush
        try:
            item = stage.frames.get(timeout=0.05)
        except queue.Empty:
            raise DataStreamException("NoFrame") from None
        if item is None:
            self._connected = False
            raise DataStreamException("NotConnected")
        self._number, self._positions = item
        return True

    def GetFrameNumber(self) -> int:
        return self._number

    def GetFrameRate(self) -> float:
        return stage.rate

    def GetLatencyTotal(self) -> float:
        return 0.004

    def GetSubjectNames(self) -> list[str]:
        return list(stage.subjects)

    def GetMarkerNames(self, subject: str) -> list[tuple[str, str]]:
        return [(marker, "Segment") for marker in stage.subjects[subject]]

    def GetMarkerGlobalTranslation(
        self, subject: str, marker: str
    ) -> tuple[tuple[float, float, float], bool]:
        assert self._markers
        position = self._positions.get(f"{subject}:{marker}")
        if position is None:
            return (0.0, 0.0, 0.0), True
        if position == "gone":
            raise DataStreamException("InvalidMarkerName")
        return position, False  # type: ignore[return-value]

"""Stands in for Rerun's library (500 MB) where that is not installed.

It has what `ikns.view.timeline` calls, with the signatures of rerun-sdk 0.41, and keeps
what it is told. The tests read back a real file where the real library is there.
"""

import json


class Told:
    def __init__(self, *args, **about):
        self.args, self.about = args, about


class Points3D(Told):
    @classmethod
    def from_fields(cls, *, positions=None, radii=None, labels=None, show_labels=None):
        return cls(positions, labels=labels)


class LineStrips3D(Told):
    @classmethod
    def from_fields(cls, *, strips=None, radii=None, colors=None):
        return cls(strips)


class Scalars(Told):
    def __init__(self, scalars):
        super().__init__(scalars)


class TextLog(Told):
    def __init__(self, text):
        super().__init__(text)


class RecordingStream:
    def __init__(self, application_id):
        self.rows, self.file, self.now = [], None, None

    def save(self, path):
        self.file = open(path, "w")  # noqa: PTH123
        self.file.write("")

    def send_recording_name(self, name):
        self.name = name

    def set_time(self, timeline, *, duration):
        assert timeline == "time"
        self.now = float(duration)

    def log(self, path, thing, *, static=False):
        if static:
            return
        numbers = thing.args[0]
        if not isinstance(numbers, str):
            numbers = (
                [n.tolist() for n in numbers]
                if isinstance(numbers, list)
                else getattr(numbers, "tolist", lambda: numbers)()
            )
        self.rows.append((path, self.now, numbers, thing.about.get("labels")))

    def flush(self):
        json.dump(self.rows, self.file)

    def disconnect(self):
        self.file.close()


def read(path):
    """Rows by path: (time, numbers, labels)."""
    with path.open() as file:
        rows = json.load(file)
    found = {}
    for where, at, numbers, labels in rows:
        found.setdefault(where, []).append((at, numbers, labels))
    return found

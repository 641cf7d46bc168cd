"""The messages of ``messages.msg``: fields, and the hash that tells versions apart.

The hash is RIHS01 of ROS's REP-2016: SHA-256 over the type's description in JSON.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

#: Numbers of the field types in ``type_description_interfaces/msg/FieldType``, of those
#: that occur here.
_NUMBERS = {
    "int8": 2,
    "uint8": 3,
    "int32": 6,
    "uint32": 7,
    "float64": 11,
    "byte": 16,
    "string": 17,
}
_NESTED = 1
#: Added to a number for a sequence without a limit.
_SEQUENCE = 144


class RosField(NamedTuple):
    """A field of a message.

    Parameters
    ----------
    name : str
    type : str
        A basic type, or a message such as ``std_msgs/msg/Header``.
    sequence : bool
        Whether it is any number of these.
    """

    name: str
    type: str
    sequence: bool

    @property
    def nested(self) -> bool:
        """Whether it is a message itself."""
        return self.type not in _NUMBERS


@cache
def definitions() -> dict[str, tuple[RosField, ...]]:
    """Return the fields of each message, by its type.

    Examples
    --------
    >>> definitions()["std_msgs/msg/Float64"]
    (RosField(name='data', type='float64', sequence=False),)
    """
    found: dict[str, list[RosField]] = {}
    package = ""
    text = Path(__file__).with_name("messages.msg").read_text("utf-8")
    for line in text.splitlines():
        if line.startswith("= "):
            own = line[2:]
            package = own.split("/")[0]
            found[own] = []
        elif line and not line.startswith("#"):
            kind, name = line.split()
            single = kind.removesuffix("[]")
            if single not in _NUMBERS:
                *where, last = single.split("/")
                single = f"{where[0] if where else package}/msg/{last}"
            found[own].append(RosField(name, single, kind.endswith("[]")))
    return {name: tuple(fields) for name, fields in found.items()}


@cache
def type_hash(type_name: str) -> str:
    """Return the hash of a message, as ROS has it.

    Examples
    --------
    >>> type_hash("std_msgs/msg/String")[:20]
    'RIHS01_df668c740482b'
    """
    described = {
        "type_description": _description(type_name),
        "referenced_type_descriptions": [
            _description(each) for each in sorted(_nested_in(type_name))
        ],
    }
    text = json.dumps(described, separators=(", ", ": "))
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


def _description(type_name: str) -> dict[str, Any]:
    return {
        "type_name": type_name,
        "fields": [
            {
                "name": field.name,
                "type": {
                    "type_id": _NUMBERS.get(field.type, _NESTED)
                    + _SEQUENCE * field.sequence,
                    "capacity": 0,
                    "string_capacity": 0,
                    "nested_type_name": field.type if field.nested else "",
                },
            }
            for field in definitions()[type_name]
        ],
    }


def _nested_in(type_name: str) -> set[str]:
    direct = {field.type for field in definitions()[type_name] if field.nested}
    return direct.union(*(_nested_in(each) for each in direct))

"""Arrays with names for pandas and xarray, which are loaded only here."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from typing import Any

from ikns.arrays import Array
from ikns.errors import InvalidInput


def data_frame(time: Array, columns: Mapping[str, Any]) -> Any:
    """Return a pandas DataFrame of columns (T,) with the index ``time_s``."""
    pandas = _library("pandas")
    return pandas.DataFrame(dict(columns), index=pandas.Index(time, name="time_s"))


def dataset(
    coordinates: Mapping[str, Any],
    variables: Mapping[str, tuple[Sequence[str], Any, str]],
) -> Any:
    """Return an xarray Dataset.

    Parameters
    ----------
    coordinates : mapping
        Values along each dimension.
    variables : mapping
        Dimensions, values and unit of each variable.
    """
    xarray = _library("xarray")
    return xarray.Dataset(
        {
            name: (dims, values, {"units": unit})
            for name, (dims, values, unit) in variables.items()
        },
        coords=dict(coordinates),
    )


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InvalidInput(
            f"this table needs {name}; install it with pip install 'ikns[tables]'."
        ) from None

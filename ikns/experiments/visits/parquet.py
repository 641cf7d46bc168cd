"""Rows of attempts as Parquet, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ikns.errors import FileError, InvalidInput
from ikns.experiments.visits.rows import COLUMNS


def table_bytes(experiment: str, rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Return a Parquet file of attempts; the same rows give the same bytes.

    Parameters
    ----------
    experiment : {"tracking", "picking"}
    rows : sequence of mapping
        All with the same columns: those of the experiment, and any others of text,
        numbers or booleans.

    Raises
    ------
    InvalidInput
        When a column is missing or of another type.
    """
    pa, parquet = _arrow()
    columns = COLUMNS[experiment]
    names = dict.fromkeys([*columns, *(rows[0] if rows else ())])
    for row in rows:
        odd = [n for n in names if n not in row] + [n for n in row if n not in names]
        if odd:
            raise InvalidInput(
                f"expected attempts of {experiment} with the columns "
                f"{', '.join(names)}, found {odd[0]} "
                f"{'missing' if odd[0] in names else 'in some only'}."
            )
    types = {
        "int": pa.int64(),
        "float": pa.float64(),
        "text": pa.string(),
        "series": pa.list_(pa.float64()),
    }
    arrays = {}
    for name in names:
        values = [row[name] for row in rows]
        if columns.get(name) == "series":
            values = [np.asarray(value, dtype=np.float64) for value in values]
        kind = types.get(columns.get(name, ""))
        try:
            arrays[name] = pa.array(values, type=kind, from_pandas=False)
        except (pa.ArrowException, TypeError, ValueError, OverflowError) as error:
            raise InvalidInput(
                f"expected {columns.get(name, 'values of one type')} in the column "
                f"{name} of attempts ({error})."
            ) from None
        if arrays[name].null_count or pa.types.is_null(arrays[name].type) and rows:
            raise InvalidInput(
                f"expected a value in the column {name} of every attempt, found none."
            )
    table = pa.table(arrays)
    texts = [f.name for f in table.schema if pa.types.is_string(f.type)]
    sink = pa.BufferOutputStream()
    # A dictionary would merge all NaN; byte stream split keeps every bit and compresses
    # better than plain encoding.
    parquet.write_table(
        table,
        sink,
        compression="zstd",
        use_dictionary=texts,
        use_byte_stream_split=_floats(pa, table.schema),
        write_statistics=False,
    )
    return bytes(sink.getvalue())


def read_rows(path: Path, experiment: str) -> list[dict[str, Any]]:
    """Read the attempts of one file.

    Raises
    ------
    FileError
        When it is damaged, or lacks a column of the experiment.
    """
    pa, parquet = _arrow()
    try:
        # Not memory-mapped, so that the file may be deleted while its data are in use.
        table = parquet.ParquetFile(path, memory_map=False).read()
    except (pa.ArrowException, OSError) as error:
        first = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: cannot be read as Parquet ({first}).") from None
    wanted = {
        "int": pa.types.is_integer,
        "float": pa.types.is_float64,
        "text": pa.types.is_string,
        "series": pa.types.is_list,
    }
    for name, kind in COLUMNS[experiment].items():
        where = table.schema.get_field_index(name)
        if where < 0 or not wanted[kind](table.schema.field(where).type):
            found = "none" if where < 0 else str(table.schema.field(where).type)
            raise FileError(
                f"{path}: expected attempts of {experiment} with {kind} in the column "
                f"{name}, found {found}."
            )
    columns = {name: _values(table.column(name)) for name in table.column_names}
    return [
        dict(zip(columns, row, strict=True))
        for row in zip(*columns.values(), strict=True)
    ]


def _values(column: Any) -> list[Any]:
    import pyarrow as pa

    if pa.types.is_list(column.type):
        return [scalar.values.to_numpy(zero_copy_only=False) for scalar in column]
    return list(column.to_pylist())


def _floats(pa: Any, schema: Any) -> list[str]:
    """Return the names of columns of doubles, as Parquet calls them."""
    names = [f.name for f in schema if pa.types.is_float64(f.type)]
    return names + [
        f"{f.name}.list.element" for f in schema if pa.types.is_list(f.type)
    ]


def _arrow() -> tuple[Any, Any]:
    """Return both modules, imported by the first visit: a tenth of a second."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    return pa, parquet

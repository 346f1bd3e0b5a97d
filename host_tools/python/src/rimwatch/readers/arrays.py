# SPDX-License-Identifier: MIT
"""Files of arrays: HDF5 by h5py, MATLAB by scipy and h5py, Parquet by pyarrow."""

from __future__ import annotations

from collections import Counter
from typing import Any, Dict

from .table import Options, ReadError, Table, as_column, flatten, need


def _same_length(columns: Dict[str, Any]) -> Table:
    """The columns of the length that most values have; the others are named in a note."""
    lengths = Counter(len(c) for c in columns.values() if len(c) > 1)
    if not lengths:
        raise ReadError("holds no array of more than one row")
    rows = max(lengths, key=lambda n: (lengths[n], n))
    table = Table({name: c for name, c in columns.items() if len(c) == rows})
    left = [name for name, c in columns.items() if len(c) != rows]
    if left:
        shown = ", ".join(left[:8]) + (f" and {len(left) - 8} more" if len(left) > 8 else "")
        table.notes.append(f"left out, since they do not have {rows} rows: {shown}")
    return table


def _datasets(group: Any, prefix: str, out: Dict[str, Any], transposed: bool) -> None:
    import numpy as np

    for key in group:
        if key.startswith("#"):  # MATLAB's own
            continue
        item = group[key]
        if hasattr(item, "keys"):
            _datasets(item, f"{prefix}{key}.", out, transposed)
        elif item.dtype.kind == "O" and item.dtype.metadata is None:
            continue
        elif item.shape:
            values = np.asarray(item)
            if transposed and values.ndim == 2:
                values = values.T
            if values.ndim == 2 and values.shape[0] == 1:
                values = values[0]
            if item.attrs.get("MATLAB_class") != b"char":
                out.update(flatten(f"{prefix}{key}", values))


def _of_hdf5(path: str, what: str, transposed: bool) -> Table:
    module = need("h5py", "h5py", what)
    columns: Dict[str, Any] = {}
    with module.File(path, "r") as file:
        _datasets(file, "", columns, transposed)
    return _same_length(columns)


def hdf5(path: str, options: Options) -> Table:
    """Columns GROUP.DATASET; of an array of rows x places DATASET[place], of records fields."""
    return _of_hdf5(path, "an HDF5 file", False)


def mat73(path: str, options: Options) -> Table:
    """MATLAB v7.3 is HDF5, with every array transposed."""
    return _of_hdf5(path, "a MATLAB v7.3 file", True)


def _struct(name: str, value: Any, out: Dict[str, Any]) -> None:
    import numpy as np

    if isinstance(value, dict):
        for key, item in value.items():
            _struct(f"{name}.{key}" if name else key, item, out)
        return
    array = np.asarray(value)
    if array.dtype.kind in "biuf" and array.ndim <= 2 and array.size > 0:
        if array.ndim == 2 and array.shape[0] == 1:
            array = array[0]
        out.update(flatten(name, array))


def mat5(path: str, options: Options) -> Table:
    """Columns VARIABLE and STRUCT.FIELD; a matrix of rows x places as NAME[place]."""
    module = need("scipy.io", "scipy", "a MATLAB v5 file")
    raw = module.loadmat(path, simplify_cells=True)
    columns: Dict[str, Any] = {}
    _struct("", {key: value for key, value in raw.items() if not key.startswith("__")}, columns)
    return _same_length(columns)


def parquet(path: str, options: Options) -> Table:
    """The columns as they are; times as seconds, texts as texts."""
    module = need("pyarrow.parquet", "pyarrow", "a Parquet file")
    source = module.read_table(path)
    table = Table()
    for name in source.column_names:
        column = source.column(name).to_numpy()
        table.columns[name] = as_column(column)
    return table

# SPDX-License-Identifier: MIT
"""Reads logs of other formats into a table, each by the package that its users keep well.

No package is needed before a file of its format is read; one that is missing is named together with
the command that installs it. `rim` starts this folder as a program (`python3 readers FILE`) and
reads the CSV that it writes.
"""

from .table import MissingPackage, Options, ReadError, Table
from .formats import FORMATS, format_of, read

__all__ = ["FORMATS", "MissingPackage", "Options", "ReadError", "Table", "format_of", "read"]

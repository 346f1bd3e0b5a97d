# SPDX-License-Identifier: MIT
"""python3 readers FILE [OPTION...]: the file as CSV on standard output. Exit status 3: it cannot
be read, and standard error says why."""

import argparse
import logging
import os
import sys

if not __package__:  # started as a folder: this folder is the package
    sys.path[0] = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    import readers
    from readers import write_mcap
else:
    import rimwatch.readers as readers
    from rimwatch.readers import write_mcap


def main() -> int:
    parser = argparse.ArgumentParser(prog="readers", description="Writes a log as CSV.")
    parser.add_argument("file")
    parser.add_argument("--dbc", default="", help="of candump logs: what the frames mean")
    parser.add_argument("--packets", default="", help="of CCSDS packets: their fields")
    parser.add_argument("--types", action="append", default=[], help="of LCM event logs")
    parser.add_argument("--rows", default="", help="topic whose messages make the rows")
    parser.add_argument("--write-mcap", default="", help="write the lines of FILE as MCAP instead")
    given = parser.parse_args()
    logging.disable(logging.WARNING)  # some packages greet
    options = readers.Options(given.dbc, given.packets, tuple(given.types), given.rows)
    try:
        if given.write_mcap:
            with open(given.file, encoding="utf-8") as lines:
                write_mcap.write(lines, given.write_mcap)
            return 0
        table = readers.read(given.file, options)
        for note in table.notes:
            print(f"note: {given.file}: {note}", file=sys.stderr)
        table.write_csv(sys.stdout)
    except readers.ReadError as reason:
        print(f"{given.write_mcap or given.file}: {reason}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())

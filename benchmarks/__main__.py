"""Run a benchmark: `python -m benchmarks NAME ...`; `python -m benchmarks NAME --help` describes it."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

from iibr_core.types import InputError

NOT_PROGRAMS = {"__init__", "__main__", "report", "scenes", "ways"}


def programs() -> list[str]:
    """Return the names of the programs."""
    return sorted({path.stem for path in Path(__file__).parent.glob("*.py")} - NOT_PROGRAMS)


def main() -> None:
    """Run the program that the command line names; bad input ends it in one line and exit code 2."""
    name = sys.argv[1].replace("-", "_") if len(sys.argv) > 1 else ""
    if name not in programs():
        print(f"usage: python -m benchmarks NAME ...\nNAME: {', '.join(programs())}", file=sys.stderr)
        sys.exit(2)
    sys.argv = [f"benchmarks {name}", *sys.argv[2:]]
    try:
        runpy.run_module(f"benchmarks.{name}", run_name="__main__")
    except InputError as error:
        print(f"benchmarks {name}: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()

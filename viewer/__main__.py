"""`python -m viewer` is `iibr`, and runs nothing that lies in the working folder, where `python -m` looks for modules
first. Against a folder there that is called viewer itself only `python -P -m viewer` or `iibr` help.
"""

import os
import sys

_HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def _is_working_folder(path: str) -> bool:
    try:
        return path == os.getcwd()
    except OSError:
        return False  # it is gone; then Python has not put it there


if __name__ == "__main__":
    if not sys.flags.safe_path and _is_working_folder(sys.path[0]) and sys.path[0] != _HERE:
        del sys.path[0]
    from viewer.entry import command

    command()

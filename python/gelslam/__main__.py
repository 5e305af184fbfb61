"""Runs the program, as `gelslam` does: python -m gelslam reconstruct scan.avi -o RUN."""
import os
import sys

from ._program import find_program


def main():
    """Become the program."""
    program = find_program()
    if program is None:
        sys.exit("gelslam: the program is not installed, only the Python module")
    os.execv(program, ["gelslam", *sys.argv[1:]])


if __name__ == "__main__":
    main()

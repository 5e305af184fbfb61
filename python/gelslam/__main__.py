"""Runs the program, as `gelslam` does: python -m gelslam reconstruct scan.avi -o RUN."""
import os
import pathlib
import shutil
import sys


def find_program():
    """The program of this wheel; of a module that has none, the one on the path. None: there is none."""
    bundled = pathlib.Path(__file__).with_name("bin") / "gelslam"
    return str(bundled) if bundled.exists() else shutil.which("gelslam")


def main():
    """Become the program."""
    program = find_program()
    if program is None:
        sys.exit("gelslam: the program is not installed, only the Python module")
    os.execv(program, ["gelslam", *sys.argv[1:]])


if __name__ == "__main__":
    main()

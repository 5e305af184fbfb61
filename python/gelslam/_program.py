"""Where the program is."""
import pathlib
import shutil


def find_program():
    """The program of this wheel or build folder; else the one on the path. None: there is none."""
    here = pathlib.Path(__file__).parent
    for bundled in (here / "bin/gelslam", here.parent.parent / "bin/gelslam"):
        if bundled.exists():
            return str(bundled)
    return shutil.which("gelslam")

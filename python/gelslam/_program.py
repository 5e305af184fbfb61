"""Where the program is."""
import pathlib
import shutil


def find_program():
    """The program of this wheel; of a module that has none, the one on the path. None: there is none."""
    bundled = pathlib.Path(__file__).with_name("bin") / "gelslam"
    return str(bundled) if bundled.exists() else shutil.which("gelslam")

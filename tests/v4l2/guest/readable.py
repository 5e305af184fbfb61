"""What `gelslam info --json` says of a recorded log: readable(INFO) gives its frames and whether it is whole."""
import re


def readable(info: dict) -> dict:
    frames = re.search(r"(\d+) frames", info["readable"])
    # The emulated camera may stand still for seconds: nothing of the log is missing then.
    damage = [problem for problem in info["problems"] if not problem.startswith("nothing new was seen")]
    return {"frames": int(frames[1]), "state": "damaged" if damage else "whole"}

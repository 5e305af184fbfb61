"""What `gelslam info --json` says of a recorded log: readable(INFO) gives its frames and whether it is whole."""
import re


def readable(info: dict) -> dict:
    frames = re.search(r"(\d+) frames", info["readable"])
    return {"frames": int(frames[1]), "state": "damaged" if info["problems"] else "whole"}

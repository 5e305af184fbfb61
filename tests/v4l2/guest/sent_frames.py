"""Whether a log holds the pictures that were sent, byte for byte: sent_frames.py LOG INFO.json FOLDER_OF_SENT_PICTURES.

A reader that lags behind v4l2loopback gets a buffer the driver is still writing to, the start of one picture and
the rest of another. That is no fault of the recorder, so a few of those may be there; anything else is one.
"""
import json
import pathlib
import sys

from readable import readable

MOST_TORN = 0.1  # share of the frames


def shared(a: bytes, b: bytes) -> int:
    """How many bytes at the start are the same."""
    low, high = 0, min(len(a), len(b))
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if a[:middle] == b[:middle] else (low, middle - 1)
    return low


def is_torn(frame: bytes, sent: list[bytes]) -> bool:
    """Whether `frame` (and what follows it in the log) begins as one sent picture and ends as another one."""
    for picture in sent:
        for rest in sent:
            for size in {len(picture), len(rest)}:
                if len(frame) < size or len(rest) < size:
                    continue
                if shared(frame, picture) + shared(frame[:size][::-1], rest[:size][::-1]) >= size:
                    return True
    return False


def main() -> None:
    log, info = pathlib.Path(sys.argv[1]).read_bytes(), json.load(open(sys.argv[2]))
    sent = [path.read_bytes() for path in sorted(pathlib.Path(sys.argv[3]).iterdir())]
    head = sent[0][: min(shared(sent[0], picture) for picture in sent)]
    frames = [head + rest for rest in log.split(head)[1:]]
    whole = sum(any(frame.startswith(picture) for picture in sent) for frame in frames)
    torn = sum(is_torn(frame, sent) for frame in frames) - whole
    found = readable(info)
    print("  frames", found["frames"], "of which byte for byte", whole, "and torn by the loopback", torn)
    assert found["state"] == "whole" and found["frames"] >= 5, info
    assert len(frames) == found["frames"], "frames begin otherwise than they were sent"
    assert whole + torn == len(frames), "frames were changed"
    assert torn <= max(1, MOST_TORN * len(frames)), "too many are torn"


main()

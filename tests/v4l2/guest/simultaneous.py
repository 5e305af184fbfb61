"""Whether a log of two sensors has nearly all pictures that both showed at the same moments, at the same times:
simultaneous.py LOG FOLDER_OF_SENT_PICTURES SECONDS_BETWEEN_PICTURES. Each file of the folder is another picture.
"""
import pathlib
import sys

PARENTS = (0x18538067, 0x1F43B675, 0xA0)  # segment, cluster, block group
ENOUGH = 0.7  # share of the frames: the emulated machine loses some, and v4l2loopback tears some
TIMESTAMP, BLOCKS = 0xE7, (0xA1, 0xA3)


def number(data: bytes, at: int, marked: bool) -> tuple[int, int]:
    """An EBML number of variable length, with or without the bit that marks its length, and where it ends."""
    length = 9 - data[at].bit_length()
    value = int.from_bytes(data[at : at + length], "big")
    return (value if marked else value & ~(1 << 7 * length)), at + length


def frames(data: bytes, at: int, end: int, time_us: int = 0):
    """Track, time in seconds and bytes of every frame."""
    while at < end:
        name, at = number(data, at, True)
        size, at = number(data, at, False)
        last = min(at + size, end)  # also where the size is unknown: all ones
        if name in PARENTS:
            yield from frames(data, at, last, time_us)
        elif name == TIMESTAMP:
            time_us = int.from_bytes(data[at:last], "big")
        elif name in BLOCKS:
            track, block = number(data, at, False)
            yield track, 1e-6 * time_us, data[block + 3 : last]
        at = last


def main() -> None:
    data, between_s = pathlib.Path(sys.argv[1]).read_bytes(), float(sys.argv[3])
    sent = {path.read_bytes() for path in pathlib.Path(sys.argv[2]).iterdir()}
    log = list(frames(data, 0, len(data)))
    times = [{picture: time_s for track, time_s, picture in log if track == wanted} for wanted in (1, 2)]
    apart = [abs(times[0][picture] - times[1][picture]) for picture in sent & times[0].keys() & times[1].keys()]
    torn = sum(picture not in sent for _, _, picture in log)
    print("  frames", *map(len, times), "torn", torn, f"pictures in both {len(apart)}, {max(apart):.3f} s apart")
    assert {track for track, _, _ in log} == {1, 2}, "not two tracks"
    for of_track in times:
        shown = (max(of_track.values()) - min(of_track.values())) / between_s + 1
        assert len(of_track) >= max(8, ENOUGH * shown), "too few frames"
    assert torn <= max(1, (1 - ENOUGH) * len(log)), "frames were changed"
    assert len(apart) >= ENOUGH * min(map(len, times)) and max(apart) < 2 * between_s, "not on one clock"


main()

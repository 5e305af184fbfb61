#!/usr/bin/env python3
"""Counts frames that are called tracked although they are wrong.

Runs `gelslam track --format ndjson` on data folders with truth. A frame is wrong when its status is "tracked", and its
pose in its trial is more than 1 mm or 5 degrees off along an axis of the sensor (wrong: along any; shown: along one that
the frame calls observable). It fails silently when along such an axis it is also further off than two of the standard
deviations that it states itself. Exit code: 0 none, 1 some, 2 wrong use.

Example: scripts/silent_failures.py ../shared/data/sequences/hard_*
"""

import argparse
import ast
import collections
import json
import math
import pathlib
import struct
import subprocess
import sys

WRONG_MM, WRONG_DEG = 1.0, 5.0
Counts = collections.namedtuple("Counts", "tracked wrong shown silent frames")
ROOT = pathlib.Path(__file__).resolve().parent.parent


def read_poses(path):
    """N x 4 x 4 numbers of a .npy file (float64, C order), as lists of 16."""
    data = path.read_bytes()
    if data[:6] != b"\x93NUMPY":
        raise ValueError("%s is no .npy file" % path)
    length, start = (struct.unpack("<H", data[8:10])[0], 10) if data[6] == 1 else (struct.unpack("<I", data[8:12])[0], 12)
    header = ast.literal_eval(data[start:start + length].decode("latin-1"))
    if header["descr"] != "<f8" or header["fortran_order"] or tuple(header["shape"][1:]) != (4, 4):
        raise ValueError("%s holds no float64 N x 4 x 4 array" % path)
    numbers = struct.unpack("<%dd" % (16 * header["shape"][0]), data[start + length:start + length + 128 * header["shape"][0]])
    return [numbers[i:i + 16] for i in range(0, len(numbers), 16)]


def rotation(pose):
    return [pose[0:3], pose[4:7], pose[8:11]]


def between(a, b):
    """a^-1 b of two rigid poses given row by row: rotation (3 x 3) and translation."""
    ra, rb = rotation(a), rotation(b)
    turn = [[sum(ra[k][i] * rb[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    gap = [b[4 * k + 3] - a[4 * k + 3] for k in range(3)]
    return turn, [sum(ra[k][i] * gap[k] for k in range(3)) for i in range(3)]


def joined(turn, shift):
    return [turn[0][0], turn[0][1], turn[0][2], shift[0], turn[1][0], turn[1][1], turn[1][2], shift[1],
            turn[2][0], turn[2][1], turn[2][2], shift[2], 0, 0, 0, 1]


def rotation_vector_deg(turn):
    cosine = max(-1.0, min(1.0, (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2))
    angle = math.acos(cosine)
    axis = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]]
    norm = math.hypot(*axis)
    if norm < 1e-12:
        return [0.0 if angle < 1 else 180.0] * 3
    return [math.degrees(angle) * a / norm for a in axis]


def errors(estimate, truth):
    """x y z in mm and rx ry rz in degrees, along the axes of the sensor; both poses in meters."""
    turn, shift = between(estimate, truth)
    return [1e3 * s for s in shift] + rotation_vector_deg(turn)


def wrong(error, observable, sigma=(0,) * 6):
    return any(o and abs(e) > max(WRONG_MM if i < 3 else WRONG_DEG, 2 * s)
               for i, (e, o, s) in enumerate(zip(error, observable, sigma)))


def count(lines, truth, background_frames=10):
    """Of a stream of NDJSON lines: frames tracked, of these wrong in any direction, of these in a direction shown, of
    these failing silently, and the numbers of those."""
    first = {}  # true pose of each trial's first frame
    tracked = wrong_anywhere = wrong_shown = 0
    silent_frames = []
    for line in lines:
        frame = json.loads(line)
        index = frame["frame"] - background_frames
        if frame["status"] != "tracked" or not 0 <= index < len(truth) or math.isnan(truth[index][0]):
            continue
        if frame["trial"] not in first:
            first[frame["trial"]] = (truth[index], frame["pose"])
        true_first, estimated_first = first[frame["trial"]]
        true_motion = joined(*between(true_first, truth[index]))
        estimated_motion = joined(*between(estimated_first, frame["pose"]))
        error = errors(estimated_motion, true_motion)
        tracked += 1
        wrong_anywhere += wrong(error, [1] * 6)
        wrong_shown += wrong(error, frame["observable"])
        if wrong(error, frame["observable"], frame["sigma_mm"] + frame["sigma_deg"]):
            silent_frames.append(frame["frame"])
    return Counts(tracked, wrong_anywhere, wrong_shown, len(silent_frames), silent_frames)


def check(program, folder):
    """count() for one data folder; None when the program failed."""
    done = subprocess.run([str(program), "track", str(folder), "--format", "ndjson"],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 1):
        return None
    return count(done.stdout.splitlines(), read_poses(pathlib.Path(folder) / "true_start_T_currs.npy"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    arguments = parser.parse_args()
    print("%-20s %7s %6s %6s %6s" % ("sequence", "tracked", "wrong", "shown", "silent"))
    total = 0
    for folder in arguments.folders:
        try:
            result = check(arguments.program, folder)
        except (OSError, ValueError) as error:
            print("silent_failures: %s" % error, file=sys.stderr)
            return 2
        if result is None:
            print("silent_failures: gelslam track failed on %s" % folder, file=sys.stderr)
            return 2
        total += result.silent
        where = " (frames %d to %d)" % (result.frames[0], result.frames[-1]) if result.frames else ""
        print("%-20s %7d %6d %6d %6d%s" % (folder.name, result.tracked, result.wrong, result.shown, result.silent, where), flush=True)
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())

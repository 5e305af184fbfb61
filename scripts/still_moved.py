#!/usr/bin/python3
"""Judges the trajectory of a log of a real sensor without knowing the truth: how many touched frames have a pose, and how
often the pose moves although the picture stands still.

Of every two frames 5 apart, the picture is still if the mean difference in the touched part is at most 3 of 255 gray levels
and 95 % differ by at most 8 (blurred, half size, a change of light left out). The pose moves if the touched part is carried
by more than 0.15 mm or turned by more than 1.5 degrees; far: 0.5 mm or 5 degrees. Touched: the picture differs from the bare
gel by 15 gray levels in 0.65 % of the pixels. For the trajectory of any program (TUM, seconds since the first frame).

Example: gelslam reconstruct scan.avi --model nnmini.pt --background bare.png --time start -o RUN
         scripts/still_moved.py scan.avi bare.png RUN/trajectory.tum
"""

import argparse
import json

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

LAG = 5
STILL_MEAN, STILL_95 = 3.0, 8.0  # gray levels
MOVED, FAR = (0.15, 1.5), (0.5, 5.0)  # mm, degrees
CHANGED, TOUCHED, TOUCHED_SHARE = 10, 15, 0.0065


def prepared(picture):
    return cv2.resize(cv2.GaussianBlur(picture, (0, 0), 1.5), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA).astype(float)


def without_light(difference):
    return difference - np.median(difference.reshape(-1, 3), axis=0)


def pictures_of(video):
    reader = cv2.VideoCapture(str(video))
    while (read := reader.read())[0]:
        yield prepared(read[1])


def poses_of(trajectory, rate_hz):
    """Poses (mm) by frame."""
    poses = {}
    for time_s, *values in np.loadtxt(trajectory, ndmin=2):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = Rotation.from_quat(values[3:]).as_matrix(), 1e3 * np.array(values[:3])
        poses[round(time_s * rate_hz)] = pose
    return poses


def is_still(before, after, touched):
    if touched.sum() < 60:
        return False
    change = np.abs(without_light(after - before)).max(axis=2)[touched]
    return change.mean() <= STILL_MEAN and np.percentile(change, 95) <= STILL_95


def carried(before, after, touched, pixel_mm):
    """mm and degrees by which the touched part moved."""
    v, u = (np.mean(axis) for axis in np.nonzero(touched))
    center = np.array(((u - touched.shape[1] / 2) * pixel_mm, (v - touched.shape[0] / 2) * pixel_mm, 0, 1))
    motion = np.linalg.inv(after) @ before
    return np.linalg.norm((motion @ center - center)[:3]), np.degrees(Rotation.from_matrix(motion[:3, :3]).magnitude())


def judge(video, background, trajectory, rate_hz, pitch_mm, first, last):
    bare, poses = prepared(cv2.imread(str(background))), poses_of(trajectory, rate_hz)
    recent, result = [], dict.fromkeys(("touched", "kept", "still", "moved", "far"), 0)
    for frame, picture in enumerate(pictures_of(video)):
        from_bare = np.linalg.norm(without_light(picture - bare), axis=2)
        recent = [*recent[-LAG:], (picture, from_bare > CHANGED)]
        if not first <= frame <= last:
            continue
        if np.mean(from_bare > TOUCHED) > TOUCHED_SHARE:
            result["touched"] += 1
            result["kept"] += frame in poses
        if frame - LAG < first or frame not in poses or frame - LAG not in poses:
            continue
        touched = recent[0][1] | recent[-1][1]
        if is_still(recent[0][0], picture, touched):
            motion = carried(poses[frame - LAG], poses[frame], touched, 2 * pitch_mm)
            result["still"] += 1
            result["moved"] += any(np.greater(motion, MOVED))
            result["far"] += any(np.greater(motion, FAR))
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video")
    parser.add_argument("background", help="picture of the bare gel")
    parser.add_argument("trajectory", help="TUM: time (s), position (m), quaternion (x y z w)")
    parser.add_argument("--rate", type=float, default=25.0, help="frames per second (default 25)")
    parser.add_argument("--pitch", type=float, default=0.0634, help="mm per pixel (default 0.0634)")
    parser.add_argument("--first", type=int, default=0, help="first frame that counts")
    parser.add_argument("--last", type=int, default=10**9)
    arguments = parser.parse_args()
    print(json.dumps(judge(*vars(arguments).values())))


if __name__ == "__main__":
    main()

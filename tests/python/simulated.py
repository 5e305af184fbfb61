"""The simulated log of tests/package, as arrays."""
import contextlib
import os
import pathlib
import sqlite3

import gelslam
import numpy as np

PROGRAM = os.environ["GELSLAM_PROGRAM"]
FOLDER = pathlib.Path(os.environ["GELSLAM_LOG"])
SCAN = FOLDER / "scan"
MODEL = FOLDER / "scan/model.json"
BARE_FRAMES = 10


def frames():
    """All (image, time_s) of the log."""
    return list(gelslam.Log(SCAN))


def sensor(images):
    return gelslam.Sensor(MODEL, background=images[:BARE_FRAMES])


def rows_of(session):
    """Of all tables: pages of a session that grew lie in another order."""
    with contextlib.closing(sqlite3.connect(session)) as database:
        return list(database.iterdump())


def true_start_T_sensor(frame):
    """Pose in meters, of a frame of the log."""
    return np.load(SCAN / "true_start_T_currs.npy")[frame - BARE_FRAMES]

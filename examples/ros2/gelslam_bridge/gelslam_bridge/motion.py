"""Rigid motions as 16 numbers, row by row."""
import math

import numpy as np

IDENTITY = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def matrix(a):
    return np.reshape(a, (4, 4))


def multiply(a, b):
    return (matrix(a) @ matrix(b)).ravel().tolist()


def inverse(a):
    return np.linalg.inv(matrix(a)).ravel().tolist()


def quaternion(a):
    """Return (x, y, z, w) of the rotation, w >= 0."""
    m = [a[0:3], a[4:7], a[8:11]]
    w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    if w > 0.5:
        x, y, z = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
        return (x / (4 * w), y / (4 * w), z / (4 * w), w)
    i = max(range(3), key=lambda axis: m[axis][axis])
    j, k = (i + 1) % 3, (i + 2) % 3
    q = [0.0] * 4
    q[i] = math.sqrt(max(0.0, 1 + m[i][i] - m[j][j] - m[k][k])) / 2
    q[j], q[k] = (m[i][j] + m[j][i]) / (4 * q[i]), (m[i][k] + m[k][i]) / (4 * q[i])
    q[3] = (m[k][j] - m[j][k]) / (4 * q[i])
    return tuple(-value for value in q) if q[3] < 0 else tuple(q)


def fixed_axes(covariance, pose):
    """Turn a 6x6 covariance along the sensor's axes (the stream's) to the header's (ROS's)."""
    turn = np.kron(np.eye(2), matrix(pose)[:3, :3])  # of the shift, and of the rotation
    return (turn @ np.reshape(covariance, (6, 6)) @ turn.T).ravel().tolist()

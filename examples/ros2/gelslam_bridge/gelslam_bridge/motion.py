"""Rigid motions as 16 numbers, row by row."""
import math

IDENTITY = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def multiply(a, b):
    return [sum(a[4 * r + k] * b[4 * k + c] for k in range(4))
            for r in range(4) for c in range(4)]


def inverse(a):
    rotation = [a[4 * c + r] for r in range(3) for c in range(3)]
    shift = [-sum(rotation[3 * r + k] * a[4 * k + 3] for k in range(3)) for r in range(3)]
    return [*rotation[0:3], shift[0], *rotation[3:6], shift[1], *rotation[6:9], shift[2],
            0.0, 0.0, 0.0, 1.0]


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
    def turn(block):  # R block R^T
        r = [pose[0:3], pose[4:7], pose[8:11]]
        half = [[sum(r[i][k] * block[k][j] for k in range(3)) for j in range(3)]
                for i in range(3)]
        return [[sum(half[i][k] * r[j][k] for k in range(3)) for j in range(3)]
                for i in range(3)]

    result = [0.0] * 36
    for top in (0, 3):
        for left in (0, 3):
            block = [[covariance[6 * (top + i) + left + j] for j in range(3)] for i in range(3)]
            for i, row in enumerate(turn(block)):
                result[6 * (top + i) + left:6 * (top + i) + left + 3] = row
    return result

"""Lines of `gelslam --serve` in, what is to be published out. Needs no ROS."""
import array
import base64
import contextlib
from dataclasses import dataclass
import http.client
import json
import queue
import socket
import threading
import time
from typing import Optional
from urllib.parse import urlsplit

import numpy as np

WAIT_S = 0.2  # until somebody may ask for the end
MOST_WAITING = 16  # lines; what is too much waits in gelslam, which says what it drops


@dataclass
class Frames:
    """Names of frames, and which end of the tree is fixed: 'map' or 'sensor'."""

    map: str = 'map'
    trial: str = 'trial'
    sensor: str = 'sensor'
    root: str = 'map'


@dataclass
class PoseItem:
    """A pose, 4 x 4 and meters, and its covariance, 6 x 6 along the axes of `frame`."""

    stamp_s: float
    frame: str
    pose: np.ndarray
    covariance: np.ndarray


@dataclass
class TransformItem:
    stamp_s: float
    parent: str
    child: str
    pose: np.ndarray


@dataclass
class SurfaceItem:
    """The surface has changed: Bridge.surface()."""


@dataclass
class ImageItem:
    stamp_s: float
    frame: str
    jpeg: array.array


@dataclass
class StatusItem:
    """What a frame is and why, and what it touches (None: nothing)."""

    stamp_s: float
    frame: str
    text: str
    area_m2: float
    center: Optional[list]  # x y in the sensor frame, meters


@dataclass
class Warn:
    text: str


def matrix(numbers):
    return np.reshape(np.array(numbers, dtype=float), (4, 4))


def fixed_axes(covariance, pose):
    """Turn a 6x6 covariance along the sensor's axes (the stream's) to the header's (ROS's)."""
    turn = np.kron(np.eye(2), pose[:3, :3])  # of the shift, and of the rotation
    return turn @ np.reshape(covariance, (6, 6)) @ turn.T


class Bridge:
    """
    Follow one stream.

    All frames are one tree: map, trial, sensor. While the map does not know the place of a new
    trial, the trial begins where the sensor was seen last.
    """

    def __init__(self, frames=None):
        self.frames = frames or Frames()
        self.dropped = False
        self.start_s = None  # Unix time of the first frame, where the log does not know it
        self._start(None)

    def _start(self, scan):
        self.scan, self.points, self.places, self.shown = scan, {}, {}, -1
        self.trial, self.home = None, None  # home: the component whose frame is the map frame
        self.map_T_trial = self.map_T_sensor = np.eye(4)

    def handle(self, line):
        message = json.loads(line)
        kind = message['type']
        if message.get('scan', self.scan) != self.scan:
            self._start(message['scan'])
        if kind == 'frame':
            yield from self._frame(message)
        elif kind == 'image':
            jpeg = array.array('B', base64.b64decode(message['jpeg']))
            yield ImageItem(self._stamp_s(message), self.frames.sensor, jpeg)
        elif kind == 'keyframe':
            self.points[message['keyframe']] = np.reshape(message['points'], (-1, 3))
        elif kind == 'map':
            self.places.update((moved['keyframe'], moved) for moved in message['keyframes'])
            self.shown = message['shown_component']
            if self.shown >= 0:
                self.home = self.shown
            yield SurfaceItem()
        elif kind == 'dropped' and not self.dropped:
            self.dropped = True
            yield Warn('too slow: some lines of the stream were dropped')

    def _frame(self, frame):
        yield self._status(frame)
        if frame['status'] not in ('tracked', 'localized'):
            return
        trial_pose, map_pose = matrix(frame['pose']), matrix(frame['map_pose'])
        yield from self._place(frame, trial_pose, map_pose)
        self.map_T_sensor = self.map_T_trial @ trial_pose
        stamp = self._stamp_s(frame)
        in_map = frame['component'] == self.home  # else it is known in its trial only
        header, pose = (self.frames.map, map_pose) if in_map else (self.frames.trial, trial_pose)
        covariance = frame['map_covariance' if in_map else 'covariance']
        yield PoseItem(stamp, header, pose, fixed_axes(covariance, pose))
        yield self._transform(stamp, self.frames.map, self.frames.trial, self.map_T_trial)
        yield self._transform(stamp, self.frames.trial, self.frames.sensor, trial_pose)

    def _status(self, frame):
        text = ': '.join(word for word in (frame['status'], frame.get('reason')) if word)
        contact = frame.get('contact') or {'area_mm2': 0, 'center_mm': None}
        center = contact['center_mm'] and [1e-3 * mm for mm in contact['center_mm']]
        return StatusItem(self._stamp_s(frame), self.frames.sensor, text,
                          1e-6 * contact['area_mm2'], center)

    def _place(self, frame, trial_pose, map_pose):
        """Set map_T_trial. Other components of the map than `home` have frames of their own."""
        begins, self.trial = frame['trial'] != self.trial, frame['trial']
        if self.home is None:
            self.home = frame['component']
        if frame['component'] == self.home:
            self.map_T_trial = map_pose @ np.linalg.inv(trial_pose)
        elif begins:
            self.map_T_trial = self.map_T_sensor @ np.linalg.inv(trial_pose)
            yield Warn('trial %d is not in the map yet: it is shown where the sensor was '
                       'last' % self.trial)

    def _transform(self, stamp, parent, child, pose):
        if self.frames.root == 'sensor':
            return TransformItem(stamp, child, parent, np.linalg.inv(pose))
        return TransformItem(stamp, parent, child, pose)

    def _stamp_s(self, message):
        """Return the Unix time of the capture; if that is unknown, as if the log began now."""
        if message['time_unix_s'] is not None:
            return message['time_unix_s']
        if self.start_s is None:
            self.start_s = time.time() - message['time_s']
        return self.start_s + message['time_s']

    def surface(self):
        """Return points x y z of the shown component, N x 3 float32, in the map frame."""
        parts = [np.empty((0, 3))]
        for name, keyframe in self.places.items():
            points = self.points.get(name)
            if keyframe['component'] == self.shown and points is not None:
                place = matrix(keyframe['map_pose'])
                parts.append(points @ place[:3, :3].T + place[:3, 3])
        return np.concatenate(parts).astype(np.float32)


def check_target(target):
    """Raise ValueError unless it is an address as gelslam --serve prints it."""
    try:
        url = urlsplit(target)
        if url.scheme == 'http' and url.hostname and url.port != 0:
            return url
    except ValueError:
        pass
    raise ValueError("target '%s': give the address that gelslam --serve prints" % target)


def ask(target, what):
    """Post /stop or /new. Return whether it is done, and the answer."""
    url = check_target(target)
    connection = http.client.HTTPConnection(url.hostname, url.port, timeout=5 * WAIT_S)
    with contextlib.closing(connection):
        try:
            connection.request('POST', '/%s?%s' % (what, url.query))
            reply = connection.getresponse()
            return reply.status // 100 == 2, reply.read().decode().strip()
        except (OSError, http.client.HTTPException) as error:
            return False, str(error)


class _Reader(threading.Thread):
    """Put lines of a stream of its own into a queue, and None at its end; or only its pictures."""

    def __init__(self, url, arrived, pictures=False):
        super().__init__(daemon=True)
        self.arrived, self.pictures, self.ends = arrived, pictures, False
        connection = http.client.HTTPConnection(url.hostname, url.port, timeout=5 * WAIT_S)
        try:
            wish = 'images' if pictures else 'surface'
            connection.request('GET', '/poses?%s=1&%s' % (wish, url.query))
            self.connected = connection.sock
            self.reply = connection.getresponse()
            if self.reply.status != http.client.OK:
                raise ValueError(self.reply.read().decode().strip())
        except Exception:
            connection.close()
            raise
        self.connected.settimeout(None)
        self.start()

    def run(self):
        with contextlib.suppress(OSError, ValueError, http.client.HTTPException):  # it is gone
            for line in self.reply:
                if not self.pictures or line.startswith(b'{"type":"image"'):
                    self._put(line.rstrip(b'\n'))
        if not self.pictures:
            self._put(None)

    def _put(self, line):
        while not self.ends:
            with contextlib.suppress(queue.Full):
                return self.arrived.put(line, timeout=WAIT_S)

    def close(self):
        self.ends = True
        with contextlib.suppress(OSError), self.connected:
            self.connected.shutdown(socket.SHUT_RDWR)


def lines(target, goes_on, pictures=lambda: True):
    """
    Yield the lines of one stream until it ends or goes_on() is false.

    Waits for the scan to start. Yields None between what arrives, and at least every WAIT_S.
    Whether pictures are wanted may change at any time.
    """
    url, arrived = check_target(target), queue.Queue(maxsize=MOST_WAITING)
    readers = []  # of all but pictures, and of these
    failures = (OSError, http.client.HTTPException)
    while goes_on() and not readers:
        try:
            readers.append(_Reader(url, arrived))
        except failures:
            yield None
            time.sleep(WAIT_S)
    try:
        while goes_on():
            if pictures() and len(readers) == 1:
                with contextlib.suppress(ValueError, *failures):
                    readers.append(_Reader(url, arrived, pictures=True))
            elif not pictures() and len(readers) == 2:
                readers.pop().close()
            try:
                line = arrived.get(timeout=WAIT_S)
            except queue.Empty:
                yield None
                continue
            if line is None:
                return
            yield line
            yield None
    finally:
        for reader in readers:
            reader.close()

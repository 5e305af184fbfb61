"""Shows a scan in Foxglove (connect to ws://localhost:8765): poses, pictures, and the surface as it grows. Needs foxglove-sdk.

Usage: foxglove_live.py MODEL [LOG]: without LOG of the camera. Of a run that is finished: gelslam export RUN -o run.mcap
"""
import itertools
import sys

if len(sys.argv) < 2 or sys.argv[1] == "--help":
    print(__doc__)
    sys.exit()

import foxglove
import gelslam
from foxglove.schemas import Color, LinePrimitive, Point3, RawImage, SceneEntity, SceneUpdate, TriangleListPrimitive


def draw(topic, **primitives):
    foxglove.log(topic, SceneUpdate(entities=[SceneEntity(frame_id="map", id=topic, **primitives)]))


def points(rows):
    return [Point3(x=x, y=y, z=z) for x, y, z in rows.tolist()]


foxglove.start_server()
gray, orange = Color(r=0.7, g=0.7, b=0.7, a=1), Color(r=1, g=0.6, b=0.2, a=1)
frames = iter(gelslam.Log(sys.argv[2]) if len(sys.argv) > 2 else gelslam.Camera())
slam = gelslam.Slam(gelslam.Sensor(sys.argv[1], background=[image for image, _ in itertools.islice(frames, 10)]))
for image, time_s in frames:
    rows, columns, _ = image.shape
    foxglove.log("/picture", RawImage(data=image.tobytes(), width=columns, height=rows, step=3 * columns, encoding="bgr8"))
    if slam.process(image, time_s).new_keyframes:
        mesh, (_, poses) = slam.mesh(), slam.trajectory()
        draw("/surface", triangles=[TriangleListPrimitive(points=points(mesh.vertices), indices=mesh.triangles.ravel().tolist(), color=gray)])
        draw("/path", lines=[LinePrimitive(points=points(poses[:, :3, 3]), thickness=1e-4, color=orange)])
        corners = [[0, 0, 0], [0.005, 0, 0], [0, 0, 0], [0, 0.005, 0], [0, 0, 0], [0, 0, 0.005]]  # along the sensor's axes, m
        draw("/sensor", lines=[LinePrimitive(points=points(corners @ poses[-1, :3, :3].T + poses[-1, :3, 3]), thickness=3e-4, color=orange)])

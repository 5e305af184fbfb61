"""Shows a scan in Rerun: poses, pictures, and the surface as it grows. Needs rerun-sdk 0.23 or newer.

Usage: rerun_live.py MODEL [LOG]: without LOG of the camera. rr.save("scan.rrd") in the place of spawn=True writes a file.
"""
import itertools
import sys

if len(sys.argv) < 2 or sys.argv[1] == "--help":
    print(__doc__)
    sys.exit()

import gelslam
import rerun as rr

rr.init("gelslam", spawn=True)
frames = iter(gelslam.Log(sys.argv[2]) if len(sys.argv) > 2 else gelslam.Camera())
slam = gelslam.Slam(gelslam.Sensor(sys.argv[1], background=[image for image, _ in itertools.islice(frames, 10)]))
for image, time_s in frames:
    rr.set_time("time", duration=time_s)
    rr.log("picture", rr.Image(image, color_model="BGR"))
    if slam.process(image, time_s).new_keyframes:
        mesh, (_, poses) = slam.mesh(), slam.trajectory()
        rr.log("map/surface", rr.Mesh3D(vertex_positions=mesh.vertices, triangle_indices=mesh.triangles, vertex_normals=mesh.normals))
        rr.log("map/path", rr.LineStrips3D([poses[:, :3, 3]]))
        rr.log("map/sensor", rr.Transform3D(translation=poses[-1, :3, 3], mat3x3=poses[-1, :3, :3]))

"""A recorded log to a mesh; shows it if Open3D is there.

Usage: reconstruct_video.py LOG [--model nnmodel.pth] [-o mesh.ply] [--show]
"""
import argparse

import gelslam

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("log")
parser.add_argument("--model")
parser.add_argument("-o", "--output", default="mesh.ply")
parser.add_argument("--show", action="store_true")
arguments = parser.parse_args()

run = gelslam.reconstruct(arguments.log, arguments.model, progress=True)
run.mesh.save(arguments.output)
print(f"{len(run.trajectory)} poses, {len(run.mesh.vertices)} vertices: {arguments.output}")

if arguments.show:
    import open3d

    mesh = run.mesh.to_open3d()
    open3d.visualization.draw_geometries([mesh])

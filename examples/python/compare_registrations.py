"""How far did the sensor move from one touch to two later ones, and how well is each motion known?

Usage: compare_registrations.py LOG FRAME FRAME FRAME --model nnmodel.pth
"""
import argparse
import sys

import gelslam
import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("log")
parser.add_argument("frames", type=int, nargs=3)
parser.add_argument("--model", required=True)
arguments = parser.parse_args()

images = [image for image, _ in gelslam.Log(arguments.log)]
for frame in arguments.frames:
    if not 0 <= frame < len(images):
        sys.exit(f"compare_registrations: no frame {frame}: the log has 0 to {len(images) - 1}")
sensor = gelslam.Sensor(arguments.model, background=images[:10])
first, *later = [sensor(images[frame]) for frame in arguments.frames]

for frame, surface in zip(arguments.frames[1:], later):
    result = gelslam.register(first, surface)
    if not result.ok:
        print(f"frame {arguments.frames[0]} to {frame}: failed: {result.reason}")
        continue
    print(f"frame {arguments.frames[0]} to {frame}: ok {result.reason}")
    sigma = np.sqrt(np.diag(result.covariance))
    for i, axis in enumerate("xyz"):
        print(f"  {axis} {1000 * result.target_T_reference[i, 3]:7.3f} mm, sigma {1000 * sigma[i]:.3f} mm;"
              f"  about {axis}: sigma {np.degrees(sigma[3 + i]):.2f} degrees")

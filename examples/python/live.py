"""Tracks a camera, or a log in its place, and prints where the sensor is. Ctrl-C ends it and saves the run.

Usage: live.py --model nnmodel.pth [--camera auto | --log LOG] [-o RUN]
"""
import argparse
import itertools

import gelslam

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--model", required=True)
parser.add_argument("--camera", default="auto")
parser.add_argument("--log")
parser.add_argument("-o", "--output", default="RUN")
arguments = parser.parse_args()

source = gelslam.Log(arguments.log) if arguments.log else gelslam.Camera(arguments.camera)
frames = iter(source)
print("Keep the gel untouched for a moment.")
bare = [image for image, _ in itertools.islice(frames, 10)]
slam = gelslam.Slam(gelslam.Sensor(arguments.model, background=bare))
try:
    for image, time_s in frames:
        frame = slam.process(image, time_s)
        if frame.status == "tracked":
            x, y, z = 1000 * frame.trial_T_sensor[:3, 3]
            print(f"{time_s:7.2f} s  trial {frame.trial}  {x:6.2f} {y:6.2f} {z:6.2f} mm  {frame.reason}")
        else:
            print(f"{time_s:7.2f} s  {frame.status}: {frame.reason}")
except KeyboardInterrupt:
    pass
finally:
    source.close()
slam.finish().save(arguments.output)
print(f"saved in {arguments.output}")

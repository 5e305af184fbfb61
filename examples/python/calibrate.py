"""Trains a model on a folder of ball presses (see docs/calibration.md) and says how good it is.

Usage: calibrate.py PRESSES -o model.json [--steps N]
"""
import argparse

import gelslam

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("presses")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("--steps", type=int)
arguments = parser.parse_args()

result = gelslam.calibrate(arguments.presses, arguments.output, steps=arguments.steps, progress=True)
for press in result.left_out:
    print("left out:", press)
print(f"{result.verdict}: {result.presses} presses, slopes are off by {result.slope_error_deg:.2f} degrees, "
      f"gradient scale x {result.gradient_scale[0]:.3f} y {result.gradient_scale[1]:.3f}")
for reason in result.reasons:
    print("note:", reason)

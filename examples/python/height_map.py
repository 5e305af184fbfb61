"""One touch to a picture of its height map.

Usage: height_map.py TOUCH --background BARE --model nnmodel.pth [-o height.png]
"""
import argparse

import gelslam
import matplotlib.pyplot as plt


def read_bgr(path):
    rgb = plt.imread(path)[..., :3]
    return (rgb if rgb.dtype == "uint8" else (255 * rgb + 0.5).astype("uint8"))[..., ::-1]


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("touch")
parser.add_argument("--background", required=True)
parser.add_argument("--model", required=True)
parser.add_argument("-o", "--output", help="picture to write (default: show it)")
arguments = parser.parse_args()

sensor = gelslam.Sensor(arguments.model, background=read_bgr(arguments.background))
surface = sensor(read_bgr(arguments.touch))
print(f"{surface.contact_pixels} pixels in contact, {-surface.height_mm.min():.2f} mm deep")

plt.imshow(surface.height_mm)
plt.colorbar(label="height (mm)")
plt.savefig(arguments.output) if arguments.output else plt.show()

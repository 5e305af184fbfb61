#!/usr/bin/python3
"""How steep flanks are read: over rings of equal true slope of labeled ball presses, the median of what models read.

Writes OUT/slopes.json and a chart, OUT/slopes.png, for the presses of two sensors in DATA, with their owner's network and
with the maker's.

Example: PYTHONPATH=build/python scripts/slopes_read.py DATA OUT
"""

import csv
import json
import pathlib
import sys
import warnings

import cv2
import gelslam
import numpy as np
from plotting import OURS, PUBLIC, plt, save

BALLS = {"markers": "5", "calibration_b": "9.47"}
PITCH_MM = 0.0634
RINGS = range(5, 45, 5)  # degrees, each as wide
INSIDE = 0.9  # of the circle that was labeled
LEAST_PIXELS = 5000


def rings_of(folder, model):
    sensor = gelslam.Sensor(model, background=cv2.imread(str(folder / "background.png")))
    read = {ring: [] for ring in RINGS}
    for press in csv.DictReader(open(folder / "catalog.csv")):
        path = folder / press["experiment_reldir"]
        label = np.load(path / "label.npz")
        normals = sensor(cv2.imread(str(path / "gelsight.png"))).normals
        v, u = np.indices(normals.shape[:2])
        distance = np.hypot(u - label["center"][0], v - label["center"][1])
        true = np.degrees(np.arcsin(np.minimum(1, distance * PITCH_MM / (float(press["diameter(mm)"]) / 2))))
        slope = np.degrees(np.arccos(np.clip(np.abs(normals[..., 2]), 0, 1)))
        for ring in RINGS:
            read[ring].append(slope[(distance < INSIDE * label["radius"]) & (np.abs(true - ring) < 2.5)])
    joined = {ring: np.concatenate(values) for ring, values in read.items()}
    return {ring: float(np.median(values)) for ring, values in joined.items() if len(values) >= LEAST_PIXELS}


def draw(slopes, path):
    figure, plots = plt.subplots(1, len(slopes), figsize=(6.4, 3.2), sharey=True)
    for plot, (presses, models) in zip(plots, slopes.items()):
        plot.plot([0, 45], [0, 45], color="gray", linewidth=1)
        for (model, read), color in zip(models.items(), (OURS, PUBLIC)):
            plot.plot(list(read), list(read.values()), "o-", color=color, markersize=4, label="the %s's network" % model)
        plot.set(title="%s mm ball" % BALLS[presses], xlabel="true slope (degrees)", xlim=(0, 45), ylim=(0, 45))
    plots[0].set_ylabel("slope read (degrees)")
    plots[0].legend()
    save(figure, path)


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__)
        sys.exit(2)
    warnings.simplefilter("ignore")
    data, out = map(pathlib.Path, sys.argv[1:])
    slopes = {presses: {"owner": rings_of(data / presses, data / presses / "model/nnmodel.pth"),
                        "maker": rings_of(data / presses, data / "real/nnmini.pt")} for presses in BALLS}
    (out / "slopes.json").write_text(json.dumps(slopes, indent=1) + "\n")
    draw(slopes, out / "slopes.png")

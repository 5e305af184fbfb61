#!/usr/bin/python3
"""How steep flanks are read: over rings of equal true slope of labeled ball presses, the median of what models read, and
what 10 and 90 % of the pixels do not exceed.

Writes OUT/slopes.json and a chart, OUT/slopes.png, for the presses of two sensors in DATA, with their owner's network and
with the maker's.

Example: PYTHONPATH=build/python scripts/slopes_read.py DATA OUT
"""

import json
import pathlib
import sys
import warnings

import cv2
import gelslam
import numpy as np
import pandas as pd
from plotting import OURS, PUBLIC, plt, save

BALLS = {"markers": "5", "calibration_b": "9.47"}
PITCH_MM = 0.0634
RING, STEEPEST = 5, 40  # degrees
INSIDE = 0.9  # of the circle that was labeled
LEAST_PIXELS = 5000
QUANTILES = {"low": 0.1, "median": 0.5, "high": 0.9}


def rings_of(folder, model):
    sensor = gelslam.Sensor(model, background=cv2.imread(str(folder / "background.png")))
    pixels = []
    for press in pd.read_csv(folder / "catalog.csv", dtype={"experiment_reldir": str}).to_dict("records"):
        path = folder / press["experiment_reldir"]
        label = np.load(path / "label.npz")
        normals = sensor(cv2.imread(str(path / "gelsight.png"))).normals
        v, u = np.indices(normals.shape[:2])
        distance = np.hypot(u - label["center"][0], v - label["center"][1])
        true = np.degrees(np.arcsin(np.minimum(1, distance * PITCH_MM / (press["diameter(mm)"] / 2))))
        slope = np.degrees(np.arccos(np.clip(np.abs(normals[..., 2]), 0, 1)))
        inside = distance < INSIDE * label["radius"]
        pixels.append(pd.DataFrame({"ring": RING * (true[inside] / RING).round().astype(int), "slope": slope[inside]}))
    rings = pd.concat(pixels).groupby("ring")["slope"]
    table = rings.quantile(list(QUANTILES.values())).unstack().set_axis(list(QUANTILES), axis="columns")
    return table[rings.size() >= LEAST_PIXELS].loc[RING:STEEPEST]


def draw(slopes, path):
    figure, plots = plt.subplots(1, len(slopes), figsize=(6.4, 3.2), sharey=True)
    for plot, (presses, models) in zip(plots, slopes.items()):
        plot.plot([0, 45], [0, 45], color="gray", linewidth=1)
        for (model, read), color in zip(models.items(), (OURS, PUBLIC)):
            plot.fill_between(read.index, read["low"], read["high"], color=color, alpha=0.15)
            plot.plot(read.index, read["median"], "o-", color=color, markersize=4, label="the %s's network" % model)
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
    tables = {presses: {model: read.to_dict("index") for model, read in models.items()} for presses, models in slopes.items()}
    (out / "slopes.json").write_text(json.dumps(tables, indent=1) + "\n")
    draw(slopes, out / "slopes.png")

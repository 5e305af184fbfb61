#!/usr/bin/env python3
"""Errors of a coarser (240x180 pixels of 0.0845 mm) and of a slower sensor (12.5 Hz) over those of DATA/sequences.

Example: GELSLAM_DATA=DATA scripts/other_sensor.py STUDY"""
import json, math, os, pathlib, shutil, subprocess, sys
import cv2
import numpy as np
DATA, STUDY = pathlib.Path(os.environ["GELSLAM_DATA"]), pathlib.Path(sys.argv[1])
BIN = pathlib.Path(__file__).resolve().parent.parent / "build/bin/gelslam"
COARSER = {"0.0634": "0.0845333", "imgh: 240": "imgh: 180", "imgw: 320": "imgw: 240", "threshold: 500": "threshold: 281"}
def run(*command): return subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout
def error_mm(log, model):
    run(BIN, "reconstruct", log, "--model", model, "-o", STUDY / "run", "--overwrite", "-q")
    return json.loads(run(BIN, "evaluate", STUDY / "run", "--truth", log, "--json"))["trajectory"]["geometric_mean_mm"]
def resampled_error_mm(log, model, video_filter, rate, every, replaced):
    copy = shutil.copytree(log, STUDY / log.name, dirs_exist_ok=True)
    run("ffmpeg", "-v", "error", "-y", "-i", log / "gelsight.avi", "-vf", video_filter, "-r", rate, "-c:v", "mjpeg", "-q:v", "2",
        "-pix_fmt", "yuvj444p", copy / "gelsight.avi")
    for old, new in replaced.items():
        (copy / "config.yaml").write_text((copy / "config.yaml").read_text().replace(old, new))
    poses = np.load(log / "true_start_T_currs.npy")[::every]
    np.save(copy / "true_start_T_currs.npy", poses)
    (copy / "meta.json").write_text(json.dumps(json.loads((log / "meta.json").read_text()) | {"frames": len(poses) + 10, "fps": float(rate)}))
    return error_mm(copy, model)

presses = shutil.copytree(DATA / "calibration_sim", STUDY / "presses", dirs_exist_ok=True)
for path in presses.rglob("*.png"):
    cv2.imwrite(str(path), cv2.resize(cv2.imread(str(path)), (240, 180), interpolation=cv2.INTER_AREA))
for path in presses.rglob("label.npz"):
    np.savez(path, **{key: (value + 0.5) * 0.75 - 0.5 if key == "center" else value * 0.75 for key, value in np.load(path).items()})
for folder, model, pitch in ((DATA / "calibration_sim", "fine.json", "0.0634"), (presses, "coarse.json", "0.0845333")):
    run(BIN, "calibrate", "train", folder, "-o", STUDY / model, "--pitch", pitch, "--overwrite", "-q")
ratios = []
for log in sorted(path.parent for path in (DATA / "sequences").glob("*/config.yaml")):
    original = error_mm(log, STUDY / "fine.json")
    ratios.append([resampled_error_mm(log, STUDY / "coarse.json", "scale=240:180:flags=area", "25", 1, COARSER) / original,
                   resampled_error_mm(log, STUDY / "fine.json", "select='lt(n,10)+not(mod(n,2))',setpts=N/12.5/TB", "12.5", 2, {"framerate: 25": "framerate: 12.5"}) / original])
    print(f"{log.name}: {original:.4f} mm, coarser {ratios[-1][0]:.2f}, slower {ratios[-1][1]:.2f} times", flush=True)
print("geometric means:", *(f"{math.exp(sum(map(math.log, column)) / len(column)):.2f}" for column in zip(*ratios)))

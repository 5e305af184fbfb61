"""Simulates a sensor, its calibration presses and a scan into a folder. Usage: simulated_log.py PROGRAM FOLDER"""
import shutil
import subprocess
import sys

program, folder = sys.argv[1:]
shutil.rmtree(folder, ignore_errors=True)
calibration = folder + "/calibration"
subprocess.run([program, "simulate", "calibration", "--presses", "60", "--epochs", "20", "-o", calibration, "-q"],
               check=True)
subprocess.run([program, "simulate", "scan", "--object", "peanut", "--motion", "wobble", "--frames", "50",
                "--calibration", calibration, "-o", folder + "/scan", "-q"], check=True)

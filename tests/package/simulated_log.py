"""Simulates a scan and presses of a ball into a folder. Usage: simulated_log.py PROGRAM FOLDER"""
import shutil
import subprocess
import sys

program, folder = sys.argv[1:]
shutil.rmtree(folder, ignore_errors=True)
for command in (["simulate", "scan", "--object", "peanut", "--motion", "wobble", "--frames", "50", "-o", folder + "/scan"],
                ["simulate", "presses", "--presses", "18", "-o", folder + "/hand"],
                ["calibrate", "collect", folder + "/hand", "-o", folder + "/presses", "--diameter", "6.31", "--presses",
                 "18", "--headless"]):
    subprocess.run([program, *command, "-q"], check=True)

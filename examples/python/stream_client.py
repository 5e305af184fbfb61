#!/usr/bin/env python3
"""Prints the position of the sensor while `gelslam scan --stream tcp:5555` runs."""
import json
import socket
import sys

port = int(sys.argv[1]) if len(sys.argv) > 1 else 5555
with socket.create_connection(("127.0.0.1", port)) as connection:
    for line in connection.makefile():
        frame = json.loads(line)
        if frame["type"] == "frame" and frame["status"] == "tracked":
            x, y, z = (1000 * frame["pose"][k] for k in (3, 7, 11))
            print("%8.2f s  trial %d  x %6.2f  y %6.2f  z %6.2f mm" % (frame["time_s"], frame["trial"], x, y, z), flush=True)

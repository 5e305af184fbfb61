#!/usr/bin/env python3
"""Prints the position of the sensor while `gelslam scan --stream tcp:5555` runs.

Usage: stream_client.py [PORT]
"""
import argparse
import json
import os
import socket
import sys


def main(port):
    with socket.create_connection(("127.0.0.1", port)) as connection:
        for line in connection.makefile():
            frame = json.loads(line)
            if frame["type"] == "frame" and frame["status"] == "tracked":
                x, y, z = (1000 * frame["pose"][k] for k in (3, 7, 11))
                print("%8.2f s  trial %d  x %6.2f  y %6.2f  z %6.2f mm" % (frame["time_s"], frame["trial"], x, y, z), flush=True)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("port", type=int, nargs="?", default=5555)
try:
    main(parser.parse_args().port)
except BrokenPipeError:  # who read this has enough, as `head` has
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains once more at its end
except ConnectionError as error:
    sys.exit(f"stream_client: {error.strerror}: does gelslam run with --stream tcp:PORT?")
except KeyboardInterrupt:
    pass

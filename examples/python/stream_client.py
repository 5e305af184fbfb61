#!/usr/bin/env python3
"""Prints the position of the sensor while `gelslam scan --serve 5555` runs.

Usage: stream_client.py ADDRESS, as gelslam prints it: http://127.0.0.1:5555/?token=...
"""
import argparse
import http.client
import json
import os
import sys
from urllib.parse import urlsplit


def lines(address):
    url = urlsplit(address)
    if not url.hostname:
        sys.exit("stream_client: give the address that gelslam prints")
    connection = http.client.HTTPConnection(url.hostname, url.port)
    connection.request("GET", "/poses?" + url.query)
    reply = connection.getresponse()
    if reply.status != http.client.OK:
        sys.exit("stream_client: " + reply.read().decode().strip())
    yield from reply


def main(address):
    for line in lines(address):
        frame = json.loads(line)
        if frame["type"] == "frame" and frame["status"] == "tracked":
            x, y, z = (1000 * frame["map_pose"][k] for k in (3, 7, 11))
            print("%8.2f s  trial %d  x %6.2f  y %6.2f  z %6.2f mm" % (frame["time_s"], frame["trial"], x, y, z), flush=True)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("address")
try:
    main(parser.parse_args().address)
except BrokenPipeError:  # who read this has enough, as `head` has
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains once more at its end
except (http.client.HTTPException, OSError, ValueError) as error:
    sys.exit(f"stream_client: {error}: does gelslam run with --serve PORT?")
except KeyboardInterrupt:
    pass

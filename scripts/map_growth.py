#!/usr/bin/python3
"""Measures what a map costs as it grows: simulates one long scan of a large stone, and continues it part by part.

At each size it prints a row of CSV, which is also written to OUT/map_growth.json: keyframes; processor time per keyframe of the
part that led there, without its end (keyframe_ms); wall and processor time and peak memory of the end, poses and mesh (end_s,
end_cpu_s, end_mb); and of a live scan that goes on from there for 10 s at the log's own pace, with mesh and streamed surface:
the median and the 99th percentile from capture to pose (latency_ms, latency_p99_ms), its peak memory (live_mb), and the bytes
of the stream per keyframe after the first map (stream_kb). Give the machine nothing else to do: latency and wall times say so
otherwise. Needs the program ffmpeg.

Example: scripts/map_growth.py STUDY --frames 1000,5000,10000,20000
"""

import argparse
import csv
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
FRAMES_PER_S, BARE_FRAMES, LIVE_FRAMES = 25, 10, 250


def run(*command):
    """Its wall and processor time (s), peak memory (MB) and output. Warnings are no failures."""
    begin = time.monotonic()
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    out = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        sys.exit(f"map_growth: {' '.join(map(str, command))} failed")
    return time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, out


def cut(scan, first, last, folder):
    """Pictures first to last of a simulated scan as a log of their own."""
    folder.mkdir(exist_ok=True)
    for name in ("config.yaml", "model.json", "optics.yaml"):
        shutil.copy(scan / name, folder)
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-ss", str((first - 0.5) / FRAMES_PER_S) if first else "0", "-i", scan / "gelsight.avi",
                    "-frames:v", str(last - first), "-c", "copy", folder / "gelsight.avi"], check=True)


def unfinished(finished, folder):
    """A copy of a run as a crash before its end leaves it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shutil.copy(finished / "config.yaml", folder)
    with sqlite3.connect(finished / "session.db") as session, sqlite3.connect(folder / "session.db") as copy:
        session.backup(copy)
        for table in ("map", "poses", "map_edges"):
            copy.execute(f"DELETE FROM {table}")


def live(gelslam, log, bare, finished, folder):
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(finished, folder, ignore=shutil.ignore_patterns("mesh.ply"))
    _, _, peak_mb, stream = run(gelslam, "scan", log, "--continue", folder, "--background", bare, "--headless", "-q", "--serve", "0", "--stream", "-",
                                "--stream-surface")
    lines = stream.split(b"\n")
    kinds = [line[9:15] for line in lines]
    known = kinds.index(b'map","') + 1 if b'map","' in kinds else 0
    added = sum(kind == b"keyfra" for kind in kinds[known:])
    sent = sum(len(line) for line, kind in zip(lines[known:], kinds[known:]) if kind in (b"keyfra", b'map","'))
    stage = json.loads((folder / "report.json").read_text())["stages"]["capture to pose"]
    return {"latency_ms": stage["median_ms"], "latency_p99_ms": stage["p99_ms"], "live_mb": peak_mb, "stream_kb": sent / 1000 / max(added, 1)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--frames", default="1000,5000,10000,20000", help="pictures after which it measures, of 25 a second; ten make a keyframe")
    parser.add_argument("--gelslam", default=ROOT / "build/bin/gelslam", type=lambda path: pathlib.Path(path).resolve())
    arguments = parser.parse_args()
    out, gelslam, sizes = arguments.out, arguments.gelslam, [int(n) for n in arguments.frames.split(",")]
    out.mkdir(parents=True, exist_ok=True)
    scan, bare, before, rows = out / "scan", out / "bare.png", None, []
    if not scan.exists():
        run(gelslam, "simulate", "scan", "--size", 3.3, "--motion", "tour", "--speed", 4, "--optics", "flat", "--frames", sizes[-1] + LIVE_FRAMES,
            "-o", scan, "-q")
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", scan / "gelsight.avi", "-frames:v", "1", bare], check=True)
    for first, last in zip([BARE_FRAMES] + sizes, sizes):
        cut(scan, first, last, out / "part")
        cut(scan, last, last + LIVE_FRAMES, out / "next")
        finished = out / f"run_{last}"
        options = ["--continue", before] if before else []
        _, cpu_s, _, _ = run(gelslam, "reconstruct", out / "part", *options, "--background", bare, "-o", finished, "-q", "--overwrite")
        unfinished(finished, out / "killed")
        end_s, end_cpu_s, end_mb, _ = run(gelslam, "fuse", out / "killed", "-o", out / "fused", "-q", "--overwrite")
        keyframes = json.loads((finished / "report.json").read_text())["keyframes"]
        added = keyframes - (rows[-1]["keyframes"] if rows else 0)
        rows.append({"frames": last, "keyframes": keyframes, "keyframe_ms": 1000 * (cpu_s - end_cpu_s) / added, "end_s": end_s,
                     "end_cpu_s": end_cpu_s, "end_mb": end_mb, **live(gelslam, out / "next", bare, finished, out / "live")})
        table = csv.DictWriter(sys.stdout, rows[0])
        if len(rows) == 1:
            table.writeheader()
        table.writerow({name: round(value, 1) for name, value in rows[-1].items()})
        sys.stdout.flush()
        (out / "map_growth.json").write_text(json.dumps(rows))
        before = finished


if __name__ == "__main__":
    main()

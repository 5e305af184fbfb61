#!/usr/bin/env python3
"""Runs the public Python reference (unchanged checkouts) on sequences and
writes trajectories, mesh and timings.

    run_reference.py --normalflow DIR --gs-sdk DIR --gelslam DIR --out DIR
                     [--mlp torch|numpy] [--video gelsight.avi] [--first] SEQ_DIR...

For each SEQ_DIR, OUT/<name>/ gets
  slam.tum, slam_groups.txt     poses after the full offline pipeline
  track.tum, track_groups.txt   frame-to-keyframe tracking alone (no loops)
  first.tum                     (--first) every frame against the first one,
                                thresholds off, as in the NormalFlow paper
  mesh.ply                      fused mesh (meters, frame of the anchor)
  run.json                      timings per stage, counts, mesh anchor frame
Poses are start_T_curr, meters; timestamp = video frame index / 25.
"""
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import argparse
import contextlib
import io
import json
import sys
import tempfile
import time
import traceback

import numpy as np

import standins

FPS = 25.0


def exact_poisson(gx, gy):
    """Least-squares integration with natural boundaries (experiment only):
    staggered divergence of the averaged gradients, inverted with the cosine
    eigenvalues 2 - 2 cos(pi k / n) of that same operator."""
    from scipy import fft
    h, w = gx.shape
    px, py = 0.5 * (gx[:, 1:] + gx[:, :-1]), 0.5 * (gy[1:] + gy[:-1])
    f = np.zeros((h, w))
    f[:, :-1] += px
    f[:, 1:] -= px
    f[:-1] += py
    f[1:] -= py
    d = (2 - 2 * np.cos(np.pi * np.arange(w) / w))[None, :] + (2 - 2 * np.cos(np.pi * np.arange(h) / h))[:, None]
    d[0, 0] = 1.0
    c = -fft.dctn(f, norm="ortho") / d
    c[0, 0] = 0.0
    return fft.idctn(c, norm="ortho")


class Clock:
    def __init__(self):
        self.t = {}

    def add(self, name, dt):
        self.t.setdefault(name, []).append(dt)

    def wrap(self, name, fn):
        def timed(*a, **k):
            t0 = time.perf_counter()
            try:
                return fn(*a, **k)
            finally:
                self.add(name, time.perf_counter() - t0)
        return timed

    def table(self):
        return {k: dict(calls=len(v), mean_ms=round(1e3 * float(np.mean(v)), 3),
                        median_ms=round(1e3 * float(np.median(v)), 3),
                        p95_ms=round(1e3 * float(np.percentile(v, 95)), 3),
                        total_s=round(float(np.sum(v)), 3)) for k, v in sorted(self.t.items())}


def quat(R):
    from scipy.spatial.transform import Rotation
    return Rotation.from_matrix(R).as_quat()


def write_tum(path, rows):
    with open(path, "w") as f:
        for i, T in rows:
            q = quat(np.asarray(T, float)[:3, :3])
            f.write("%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n" % ((i / FPS,) + tuple(T[:3, 3]) + tuple(q)))


def write_groups(path, rows):
    with open(path, "w") as f:
        for i, g in rows:
            f.write("%d %d\n" % (i, g))


def run_one(seq, out, video, first, mods):
    import cv2
    name = os.path.basename(os.path.normpath(seq))
    od = os.path.join(out, name)
    os.makedirs(od, exist_ok=True)
    clk = Clock()
    gsr, nfu, trk, kfm, pgm, cgm, off, nfr = (mods[k] for k in
                                              ("gsr", "nfu", "trk", "kfm", "pgm", "cgm", "off", "nfr"))
    keep = {}

    def patch(obj, attr, new):
        keep.setdefault((obj, attr), getattr(obj, attr))
        setattr(obj, attr, new)

    # stage timers around names looked up at call time
    patch(gsr, "poisson_dct_neumaan",
          clk.wrap("poisson", exact_poisson if mods.get("exact") else gsr.poisson_dct_neumaan))
    patch(gsr, "image2bgrxys", clk.wrap("features", gsr.image2bgrxys))
    patch(gsr.BGRXYMLPNet, "forward", clk.wrap("mlp", gsr.BGRXYMLPNet.forward))
    patch(gsr.Reconstructor, "get_surface_info", clk.wrap("surface_info_total", gsr.Reconstructor.get_surface_info))
    patch(nfu, "gxy2laplacian", clk.wrap("laplacian", nfu.gxy2laplacian))
    patch(nfu, "erode_contact_mask", clk.wrap("mask_erosion", nfu.erode_contact_mask))
    patch(nfu, "gxy2normal", clk.wrap("normals", nfu.gxy2normal))
    patch(trk, "normalflow", clk.wrap("normalflow_track", trk.normalflow))
    patch(pgm, "normalflow", clk.wrap("normalflow_loop", pgm.normalflow))
    patch(kfm, "get_sift_features", clk.wrap("sift", kfm.get_sift_features))
    patch(kfm, "mask2weight", clk.wrap("weights", kfm.mask2weight))
    patch(pgm.PoseGraph, "detect_and_add_loops", clk.wrap("loop_detection", pgm.PoseGraph.detect_and_add_loops))
    patch(cgm.CoverageGraph, "update_wrt_new_keyframes",
          clk.wrap("coverage_new", cgm.CoverageGraph.update_wrt_new_keyframes))
    patch(cgm.CoverageGraph, "update_wrt_loop_closure",
          clk.wrap("coverage_loop", cgm.CoverageGraph.update_wrt_loop_closure))
    patch(off, "compute_adjusted_pointcloud", clk.wrap("mesh_fusion", off.compute_adjusted_pointcloud))
    # capture of the internal state
    st = dict(frames=[], kdb=None, pgi=None, sol=None, loops=[], sol_online={})
    track0 = trk.Tracker.track
    frame0 = {}

    def track(self, image, log_prefix="Track"):
        i = st.setdefault("n", 0)
        st["n"] = i + 1
        t0 = time.perf_counter()
        ret = track0(self, image, log_prefix)
        dt = time.perf_counter() - t0
        if len(self.bg_images) == 10 and i >= 10:
            clk.add("track_total", dt)
        if ret[0]:
            m, kms = ret[1]
            st["frames"].append((i, m.ref_kid, np.array(m.ref_t_curr).reshape(4, 4), m.fid))
            if "img0" not in frame0:
                frame0["img0"] = i
        return ret

    patch(trk.Tracker, "track", track)
    K0 = off.KeyFrameDB

    class K(K0):
        def __init__(self, *a):
            super().__init__(*a)
            st["kdb"] = self

    P0 = off.ParentGroupsInfo

    class P(P0):
        def __init__(self):
            super().__init__()
            st["pgi"] = self

    patch(off, "KeyFrameDB", K)
    patch(off, "ParentGroupsInfo", P)
    solve0 = pgm.PoseGraph.solve

    def solve(self):
        t0 = time.perf_counter()
        r = solve0(self)
        clk.add("pose_graph_solve_standin", time.perf_counter() - t0)
        st["sol"], st["graph"] = r, self
        return r

    patch(pgm.PoseGraph, "solve", solve)
    det = pgm.PoseGraph.detect_and_add_loops

    def detect(self, kdb, k, cg):
        r = det(self, kdb, k, cg)
        st["loops"] += [(int(x), int(k)) for x in r]
        return r

    patch(pgm.PoseGraph, "detect_and_add_loops", detect)
    run = dict(name=name, video=video, error=None)
    t0 = time.perf_counter()
    try:
        with tempfile.TemporaryDirectory() as tmp:
            os.symlink(os.path.abspath(os.path.join(seq, video)), os.path.join(tmp, "gelsight.avi"))
            argv = sys.argv
            sys.argv = ["gelslam_offline", "-d", tmp, "-c", os.path.join(seq, "config.yaml")]
            log = io.StringIO()
            try:
                with contextlib.redirect_stdout(log):
                    off.main()
            except Exception:
                run["error"] = traceback.format_exc(limit=3)
            finally:
                sys.argv = argv
            ply = os.path.join(tmp, "gelslam_offline", "reconstructed_mesh.ply")
            if os.path.exists(ply):
                with open(ply, "rb") as f, open(os.path.join(od, "mesh.ply"), "wb") as g:
                    g.write(f.read())
        run["wall_s"] = round(time.perf_counter() - t0, 2)
        kdb, pgi, sol = st["kdb"], st["pgi"], st["sol"]
        run["video_frames"] = st.get("n", 0)
        run["tracked_frames"] = len(st["frames"])
        if sol is not None:
            kf = kdb.keyframes
            # without loops: chain the keyframes inside their trial
            odo = []
            for k in kf:
                odo.append(np.eye(4) if k.is_new_trial() else odo[-1] @ k.ref_T_curr)
            slam, sg, tr, tg = [], [], [], []
            for i, kid, T, _ in st["frames"]:
                k = min(kid, len(kf) - 1)
                slam.append((i, np.asarray(sol[k], float) @ T))
                sg.append((i, int(pgi.parent_groups[kf[k].trial_group])))
                tr.append((i, odo[k] @ T))
                tg.append((i, int(kf[k].trial_group)))
            write_tum(os.path.join(od, "slam.tum"), slam)
            write_groups(os.path.join(od, "slam_groups.txt"), sg)
            write_tum(os.path.join(od, "track.tum"), tr)
            write_groups(os.path.join(od, "track_groups.txt"), tg)
            big = int(pgi.get_largest_parent_group())
            # the mesh lives in the frame of the trial head whose prior remains
            heads = [k for k in kf if k.trial_group == big and k.is_new_trial()]
            fid2video = {fid: i for i, _, _, fid in st["frames"]}
            run["mesh_anchor_frame"] = fid2video.get(heads[0].fid) if heads else None
            run["keyframe_video_frames"] = [fid2video.get(k.fid) for k in kf]
            run["keyframes"] = len(kf)
            run["trials"] = int(max(g for _, g in tg) + 1)
            run["groups_after_loops"] = len(set(g for _, g in sg))
            run["loop_edges"] = st["loops"]
            run["sift_keypoints_mean"] = round(float(np.mean([len(k.kp) for k in kf])), 1)
        if first:
            cap = cv2.VideoCapture(os.path.join(seq, video))
            bg, ref, prev, rows, lost = [], None, np.eye(4, dtype=np.float32), [], 0
            import yaml
            with open(os.path.join(seq, "config.yaml")) as f:
                cfg = yaml.safe_load(f)
            rec = gsr.Reconstructor(cfg["device_config"]["calibration_model_path"])
            i = -1
            nf = clk.wrap("normalflow_first", nfr.normalflow)
            while True:
                ok, im = cap.read()
                if not ok:
                    break
                i += 1
                if i < 10:
                    bg.append(im)
                    if i == 9:
                        rec.load_bg(np.mean(bg, axis=0))
                    continue
                G, Hm, C = keep[(gsr.Reconstructor, "get_surface_info")](rec, im, 0.0634)
                f = nfu.Frame(G, Hm, C)
                if not f.is_contacted:
                    continue
                if ref is None:
                    ref = f
                    rows.append((i, np.eye(4)))
                    continue
                try:
                    prev = nf(ref.N, ref.C, ref.H, ref.L, f.N, f.C, f.H, f.L, prev, 0.0634,
                              scr_threshold=0.0, ccs_threshold=0.0)
                    rows.append((i, np.linalg.inv(prev)))
                except nfr.LoseTrackError:
                    lost += 1
                    rows.append((i, np.linalg.inv(prev)))
            write_tum(os.path.join(od, "first.tum"), rows)
            run["first_lost"] = lost
    finally:
        for (o, a), v in keep.items():
            setattr(o, a, v)
    run["timing"] = clk.table()
    t = clk.t
    if t.get("surface_info_total"):
        run["timing_summary_ms_per_frame"] = dict(
            image_to_gradient=round(1e3 * (np.median(t["mlp"]) + np.median(t["features"])), 2),
            poisson=round(1e3 * np.median(t["poisson"]), 2),
            mask_tan_rest=round(1e3 * (np.median(t["surface_info_total"]) - np.median(t["mlp"]) -
                                       np.median(t["features"]) - np.median(t["poisson"])), 2),
            laplacian=round(1e3 * np.median(t["laplacian"]), 2),
            normals_erosion=round(1e3 * (np.median(t["normals"]) + np.median(t["mask_erosion"])), 2),
            normalflow=round(1e3 * np.median(t.get("normalflow_track", [0])), 2),
            track_total=round(1e3 * np.median(t.get("track_total", [0])), 2))
    with open(os.path.join(od, "run.json"), "w") as f:
        json.dump(run, f, indent=1)
    print("%-14s %6.1f s  frames %s tracked %s keyframes %s trials %s -> groups %s loops %s  %s" % (
        name, run.get("wall_s", -1), run.get("video_frames"), run.get("tracked_frames"), run.get("keyframes"),
        run.get("trials"), run.get("groups_after_loops"), len(run.get("loop_edges", [])),
        (run["error"] or "").strip().splitlines()[-1:] or ""), flush=True)


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument("--normalflow", required=True)
    ap.add_argument("--gs-sdk", required=True)
    ap.add_argument("--gelslam", required=True)
    ap.add_argument("--out", required=True)
    ap.add_argument("--mlp", choices=("torch", "numpy"), default="torch")
    ap.add_argument("--video", default="gelsight.avi")
    ap.add_argument("--first", action="store_true")
    ap.add_argument("--exact-poisson", action="store_true",
                    help="experiment, NOT the reference: replace its integrator by an exact one")
    ap.add_argument("seq", nargs="+")
    a = ap.parse_args()
    if a.mlp == "numpy":
        standins.install_numpy_torch()
    used = standins.install()
    g = a.gelslam
    if os.path.isdir(os.path.join(g, "src", "gelslam")):
        g = os.path.join(g, "src", "gelslam")
    for p in (a.normalflow, a.gs_sdk, g):
        sys.path.insert(0, os.path.abspath(p))
    import cv2
    cv2.setNumThreads(1)
    import torch
    torch.set_num_threads(1)
    import importlib
    mods = {k: importlib.import_module(v) for k, v in dict(
        gsr="gs_sdk.gs_reconstruct", nfu="normalflow.utils", nfr="normalflow.registration",
        trk="gelslam.core.tracker", kfm="gelslam.core.keyframe", pgm="gelslam.core.pose_graph",
        cgm="gelslam.core.coverage_graph", off="gelslam.scripts.gelslam_offline").items()}
    mods["exact"] = a.exact_poisson
    print("torch %s, stand-ins: %s" % (torch.__version__, ", ".join(used)), flush=True)
    for s in a.seq:
        run_one(s, a.out, a.video, a.first, mods)


if __name__ == "__main__":
    main()

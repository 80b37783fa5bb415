# SPDX-License-Identifier: MIT
"""The live view shows the newest values, and a viewer that is stuck or dead hurts nobody."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import gtsam
import numpy as np
import pandas as pd
import pytest

pytest.importorskip("rerun", reason="the viewer (extra viz) is not installed")

from vtgtsam import PoseEstimator, load_hand, load_object  # noqa: E402
from vtgtsam.camera import CameraIntrinsics  # noqa: E402
from vtgtsam.exceptions import VtgtsamError  # noqa: E402
from vtgtsam.live import page, view  # noqa: E402
from vtgtsam.live.clock import RunClock  # noqa: E402
from vtgtsam.live.fusion import Fusion  # noqa: E402
from vtgtsam.live.inputs import Inputs  # noqa: E402
from vtgtsam.live.page import PageServer, free_address  # noqa: E402
from vtgtsam.live.recorder import Recorder  # noqa: E402
from vtgtsam.live.view import LiveView, Setup, Where  # noqa: E402

T_WH = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, -0.2, 0.3), np.array([0.0, 0.1, 0.5]))
T_WO = gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.15, 0.5]))
CAMERA = CameraIntrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)
FRAME = SimpleNamespace(depth=np.full((4, 6), 0.5, np.float32), color=None)


@pytest.fixture(scope="module")
def setup():
    return Setup(
        load_hand("isyhand"), load_object("can"), T_WH, CAMERA, camera_is_world=True, truth=True
    )


class Run:
    """What a live run has: inputs, a clock, and a fusion with a new estimate at each call."""

    def __init__(self, setup):
        hand = self._hand = setup.hand
        self.clock = RunClock()
        self.inputs = Inputs(
            hand.joint_names, hand.pad_names, self.clock.now_ns, Recorder(None), hand_moves=True
        )
        self.inputs.put_hand_pose(0, T_WH)
        estimator = PoseEstimator(hand, setup.obj)
        self.fusion = Fusion(self.inputs, estimator, self.clock.now_ns, rate=1e6)

    def step(self):
        """One more sample of each stream, and its estimate; the instant [ns]."""
        now_ns = self.clock.now_ns()
        joints = np.full(len(self._hand.joint_names), 0.1)
        contacts = np.arange(len(self._hand)) < 2
        self.inputs.put_joints(now_ns, self._hand.joint_names, joints.tolist())
        self.inputs.put_contacts(now_ns, self._hand.pad_names, contacts.tolist())
        self.inputs.put_vision(now_ns, T_WO)
        assert self.fusion.step() is not None
        return now_ns

    def show_in(self, shown):
        shown.watch(self.inputs, self.fusion, self.clock.now_ns, lambda: FRAME, lambda: "fine")


def rows(path):
    """Tables of a .rrd file by entity."""
    from rerun.chunk import RrdReader

    tables = {}
    for chunk in RrdReader(path).stream():
        tables.setdefault(chunk.entity_path, []).append(chunk.to_record_batch().to_pandas())
    return {entity: pd.concat(parts) for entity, parts in tables.items()}


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_hand_object_truth_image_and_errors_of_a_run_are_in_the_file(setup, tmp_path, monkeypatch):
    monkeypatch.setattr(view, "_END", 120.0)  # a busy computer
    path, run = tmp_path / "live.rrd", Run(setup)
    with LiveView(Where(save=path), setup) as shown:
        run.show_in(shown)
        instants = []
        while shown.shown < 5:
            instants.append(run.step())
            shown.truth(instants[-1], T_WO)
            time.sleep(0.05)
    tables = rows(path)
    live = tables["/world/object/live"]
    positions = np.stack([t[0] for t in live["Transform3D:translation"].dropna()])
    last = run.fusion.last.T_wo.translation()
    np.testing.assert_allclose(positions[-1], last, atol=1e-4)  # the estimates hardly move
    times = {round(t / np.timedelta64(1, "ns")) for t in live["time"]}
    assert times <= set(instants)  # an estimate stands at its own instant
    assert "/world/object/truth" in tables
    assert "EncodedDepthImage:blob" in tables["/world/camera/depth"]
    errors = [value[0] for value in tables["/plots/adds_mm/live"]["Scalars:scalars"].dropna()]
    assert 0 <= max(errors) < 20  # [mm]
    words = tables["/streams"]["TextDocument:text"].dropna()
    assert words.iloc[-1][0] == "fine"
    ellipsoid = tables["/world/uncertainty/live"]["Ellipsoids3D:half_sizes"].dropna().iloc[-1][0]
    assert 1e-4 < max(ellipsoid) < 0.02  # [m]
    assert (tables["/status/live"]["TextLog:text"].dropna().str[0] == "live: ok").any()


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_stuck_or_dead_viewer_neither_slows_the_run_nor_keeps_it_from_ending(
    setup, tmp_path, monkeypatch, caplog, number
):
    monkeypatch.setattr(view, "_END", 0.5)
    monkeypatch.setattr(view, "RATE", 1000.0)  # so that the pipe is full at once
    run = Run(setup)
    run.step()
    shown = LiveView(Where(save=tmp_path / "live.rrd"), setup)
    run.show_in(shown)
    wait_until(lambda: shown.shown > 0)
    os.kill(shown._process.pid, number)
    wait_until(lambda: _stands_still(shown))
    slowest = 0.0
    for _ in range(50):
        before = time.monotonic()
        shown.truth(run.step(), T_WO)
        slowest = max(slowest, time.monotonic() - before)
    assert slowest < 0.5  # [s]; a blocked call would take for ever
    before = time.monotonic()
    with caplog.at_level(logging.WARNING):
        shown.close()
    assert time.monotonic() - before < 5.0
    shown._process.join(5.0)
    assert not shown._process.is_alive()
    assert len(caplog.records) <= 1


def _stands_still(shown):
    count = shown.shown
    time.sleep(0.3)
    return shown.shown == count


def test_what_is_missing_is_said_before_the_hand_moves(tmp_path, monkeypatch):
    with pytest.raises(VtgtsamError, match=r"cannot listen at '192\.0\.2\.1'"):
        free_address("192.0.2.1")
    with monkeypatch.context() as patch:
        patch.setattr(page, "_rerun", lambda: tmp_path / "none")
        with pytest.raises(VtgtsamError, match="the live page needs Rerun"):
            Where(free_address()).check()
    with pytest.raises(VtgtsamError, match="cannot write"):
        Where(save=tmp_path / "no" / "such.rrd").check()


def test_the_page_is_served_to_this_computer_alone_and_ends_with_the_run(setup):
    address, run = free_address(), Run(setup)
    run.step()
    with LiveView(Where(page=address), setup) as shown:
        run.show_in(shown)
        wait_until(lambda: shown.shown > 0)
        with urllib.request.urlopen(f"http://127.0.0.1:{address.page}/", timeout=10) as answer:
            assert b"rerun" in answer.read().lower()
        assert listened_at(address.page) == listened_at(address.data) == {"0100007F"}
    assert listened_at(address.page) == listened_at(address.data) == set()


def listened_at(port):
    """Addresses at which some program of this computer listens on a port, as the kernel writes them."""
    lines = [
        line.split()
        for table in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{table}").read_text(encoding="ascii").splitlines()[1:]
    ]
    places = (fields[1].split(":") for fields in lines if fields[3] == "0A")
    return {host for host, hexadecimal in places if int(hexadecimal, 16) == port}


def test_a_taken_port_is_not_used():
    first = free_address()
    with PageServer(first):
        second = free_address(port=first.page)
        assert second.page != first.page
    assert f"127.0.0.1:{second.page}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A" in second.url


@pytest.mark.slow
def test_an_emulated_run_is_shown_as_it_goes(tmp_path):
    path = tmp_path / "run.rrd"
    command = [sys.executable, "-m", "hardware", "run", "--emulate", "--object", "can"]
    done = subprocess.run(
        [*command, "--save-view", str(path)],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"rerun {path}" in done.stdout
    tables = rows(path)
    for entity in (
        "world/object/live",
        "world/object/truth",
        "world/hand/pads",
        "world/camera/depth",
    ):
        assert len(tables[f"/{entity}"]) > 10

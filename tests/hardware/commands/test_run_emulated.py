# SPDX-License-Identifier: MIT
"""``python -m hardware run --emulate`` as people start it, and ways in which it may end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import gtsam
import numpy as np
import pytest

from vtgtsam import EstimatorConfig, PoseEstimator, adds, load_object, read_recording
from vtgtsam.recording import RecordingWriter

ROOT = Path(__file__).parents[3]
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
WAIT = 300  # [s], a busy machine and an empty cache
LYING = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
)  # R_wo of a can across the palm


def _start(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "hardware", *arguments],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _run(*arguments):
    process = _start(*arguments)
    try:
        out, err = process.communicate(timeout=WAIT)
    finally:
        process.kill()
    return process.returncode, out, err


@pytest.fixture(scope="module")
def emulated_run(tmp_path_factory):
    """The recording of an emulated run, and what it printed."""
    path = tmp_path_factory.mktemp("run") / "out.mcap"
    code, out, err = _run("run", "--emulate", "--object", "can", "--record", str(path))
    assert code == 0, out + err
    return path, out


@pytest.mark.slow
def test_a_replay_of_the_recording_gives_the_poses_of_the_live_run(emulated_run):
    path, out = emulated_run
    assert "found can at --start" in out
    assert "torque is off" in out
    assert "sensor-to-pose latency" in out

    recording = read_recording(path)
    measurements, live = recording.measurements(rate="recorded"), recording.estimates
    assert len(measurements) == len(live.times) > 30
    estimator = PoseEstimator(recording.hand, recording.object, EstimatorConfig.tuned())
    replayed = [estimator.update(measurement).T_wo for measurement in measurements]
    for T_replayed, T_live in zip(replayed, live.poses, strict=True):
        # A recorded quaternion has lost its last bits.
        np.testing.assert_allclose(T_replayed.matrix(), T_live.matrix(), rtol=0, atol=1e-12)

    assert max(np.count_nonzero(m.contacts) for m in measurements) >= 3  # it was a grasp
    truth = recording.truth_at([m.time for m in measurements])
    errors = [
        adds(recording.object.mesh, T_wo, T_true)
        for T_wo, T_true in list(zip(replayed, truth, strict=True))[::10]
        if T_true is not None
    ]
    assert np.median(errors) < 0.01  # [m]
    assert json.loads(recording.info["config"])["method"] == "vis+tac+pen+mem"


def _calibrations(folder, T_ch):
    """Files that a real run reads, as for the emulated pads and a hand at T_ch in the camera frame."""
    from hardware.camera.wrist import save_wrist
    from hardware.emulate.pad_signal import bench_scale, pad_parameters
    from hardware.servo.description import load_description, wiring_of
    from hardware.tactile.pressure import save_scale

    wiring = wiring_of(load_description("isyhand"))
    seed = np.random.SeedSequence(0).spawn(2)[0]
    save_scale(folder / "pads.yaml", bench_scale(wiring, pad_parameters(wiring, seed)), wiring)
    save_wrist(folder / "wrist.yaml", T_ch)
    return ["--scale", str(folder / "pads.yaml"), "--wrist", str(folder / "wrist.yaml")]


def _film(path):
    """A minute of images of the open hand with the can on it; where hand and can are, in the camera frame."""
    from sim.camera import D435, DepthCamera
    from sim.hands import load_description
    from sim.observe import camera_pose, window
    from sim.placement import above_palm
    from sim.replay import Replay
    from sim.world import World

    description, can = load_description("isyhand"), load_object("can")
    world = World(description, description.load_hand(), can)
    world.refresh()
    T_wc, T_wo = camera_pose(world), above_palm(description, can.mesh, LYING)
    camera = window(world, T_wc, D435.scaled(0.5))
    replay = Replay(world.model, world.hand.joint_names)
    replay.show(world.start, world.T_wh(), T_wo)
    depth, _ = DepthCamera(world.model, camera).render(replay.data, T_wc)
    with RecordingWriter(path) as writer:
        writer.camera_info(0.0, camera)
        for instant in np.arange(0.0, 60.0, 0.1):
            writer.depth(instant, depth)
    return T_wc.between(gtsam.Pose3(world.T_wh())), T_wc.between(gtsam.Pose3(T_wo))


@pytest.mark.slow
def test_a_hand_on_real_ports_is_run_by_the_same_command(tmp_path):
    """Another process serves the ports, a recording is the camera; nothing here says --emulate."""
    from hardware.live.find import as_start
    from vtgtsam.vision.first_pose import Candidate

    seen, out = tmp_path / "seen.mcap", tmp_path / "out.mcap"
    T_ch, T_co = _film(seen)
    hand_file = tmp_path / "isyhand.yaml"
    text = (ROOT / "hardware/data/isyhand.yaml").read_text(encoding="utf-8")
    relaxed = text.replace("watchdog: 0.2 ", "patience: 0.1\nwatchdog: 2.5 ")  # a busy machine
    hand_file.write_text(relaxed, encoding="utf-8")
    served = _start("emulate")
    try:
        ports = json.loads(served.stdout.readline())
        code, text, err = _run(
            *("run", "--object", "can", "--hand", str(hand_file), "--yes", "--seconds", "3"),
            *("--servos", ports["servos"], "--pads", ports["pads"], "--camera", str(seen)),
            *(*_calibrations(tmp_path, T_ch), "--record", str(out)),
            *("--start", as_start(Candidate(T_co, 1.0, 0.0), T_ch)),
        )
        assert code == 0, text + err
        assert "The hand will move" in text  # a person is told, even where nobody is asked
        assert "from where the wrist calibration puts it" in text
        assert "baseline of 16 pads measured" in text
        assert "torque is off" in text
        recording = read_recording(out)
        assert recording.info["emulated"] == "no"
        joints = np.array([m.joints for m in recording.measurements(rate="recorded")])
        assert np.ptp(joints, axis=0).max() > 0.3  # [rad], the hand on those ports did move
        code, text, _ = _run("check", "--servos", ports["servos"], "--pads", ports["pads"])
        assert "15 of 15 answer" in text
    finally:
        served.kill()
        served.communicate()


@pytest.fixture
def closing():
    """A run whose hand is closing."""
    process = _start("run", "--emulate", "--object", "can")
    for line in process.stdout:
        if "closing" in line:
            break
    yield process
    process.kill()
    process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_ends_it_with_torque_off(closing, number, code):
    closing.send_signal(number)
    _, err = closing.communicate(timeout=WAIT)
    assert closing.returncode == code, err
    assert "Traceback" not in err
    assert "torque" not in err  # neither ours nor the emulated hand complains of any left


@pytest.mark.slow
def test_after_kill_9_the_watchdogs_stop_all_servos_and_nothing_is_left_behind(closing):
    closing.kill()
    _, err = closing.communicate(timeout=WAIT)  # ends when the rig, which shares stderr, has ended
    assert "15 servos were stopped by their watchdogs" in err


def test_emulate_first_says_where_it_serves():
    process = _start("emulate")
    try:
        ports = json.loads(process.stdout.readline())
        assert set(ports) == {"servos", "pads"}
        assert all(Path(port).exists() for port in ports.values())
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=WAIT)
        assert process.returncode == 130
    finally:
        process.kill()


def test_check_of_the_emulated_hand_finds_every_servo_and_pad():
    code, out, err = _run("check", "--emulate")
    assert "15 of 15 answer at 1000000 baud" in out, out + err
    assert "pad_palm_inner_1 and pad_palm_inner_2:" in out
    assert "thumb_rotation (servo 24): 5.0 V, 28 °C" in out
    assert code in (0, 1)  # on a busy machine readings may be rare, and it says so


def test_without_devices_it_says_what_to_give():
    code, _, err = _run("run", "--object", "can", "--pads", "/dev/null")
    assert code == 2
    assert "--servos" in err and "--emulate" in err


@pytest.mark.slow  # its parts are tested by themselves, with the tag and the hand rendered
def test_calibrate_wrist_writes_what_a_run_reads(tmp_path):
    from hardware.camera.wrist import load_wrist

    path = tmp_path / "wrist.yaml"
    code, out, err = _run("calibrate-wrist", "--emulate", "--wrist", str(path))
    assert code == 0, out + err
    assert load_wrist(path).translation()[2] > 0.2  # [m], in front of the camera

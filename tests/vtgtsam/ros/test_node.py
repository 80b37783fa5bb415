# SPDX-License-Identifier: MIT
"""The node with the genuine rclpy: another robot plays a grasp in real time, a third program listens."""

from __future__ import annotations

import json
import re
import signal

import numpy as np
import pytest
from node_bench import HERE, ROOT, wait_until

pytest.importorskip("rclpy", reason="rclpy is not installed here: make test-ros has it")

from vtgtsam import Calibration, load_hand, read_recording  # noqa: E402
from vtgtsam.calibration.robot import Robot  # noqa: E402
from vtgtsam.live.replay import replay  # noqa: E402
from vtgtsam.recording import messages  # noqa: E402

ERROR, WARN = 2, 1


def replayed(path):
    """A recording replayed at its recorded instants, by instant [ns]; none where nothing was fused in it."""
    recording = read_recording(path)
    if recording.estimates is None:
        return {}
    estimates = replay(recording)
    stamps = recording.streams.estimate.times_ns.tolist()
    return dict(zip(stamps, estimates, strict=True))


def stamp_of(message):
    return messages.stamp_ns(message)


def position(message):
    p = message.pose.pose.position
    return np.array([p.x, p.y, p.z])


def assert_replay_gives_the_poses(paths, poses):
    found = {stamp: estimate for path in paths for stamp, estimate in replayed(path).items()}
    assert len(poses) > 10 and set(map(stamp_of, poses)) <= set(found)
    for message in poses:
        expected = found[stamp_of(message)].T_wo
        assert messages.pose_from_fields(message.pose.pose).equals(expected, 1e-9)
    return found


def test_another_robots_grasp_gives_the_poses_of_its_recording_replayed(
    start, start_node, start_robot, listener, grasp, tmp_path
):
    path, program = tmp_path / "run.mcap", tmp_path / "listen.py"
    page = (ROOT / "docs" / "how-to" / "live.md").read_text(encoding="utf-8")
    program.write_text(
        re.search(r'title="listen.py"\n(.*?)```', page, re.DOTALL)[1], encoding="utf-8"
    )
    node = start_node("--record", path)
    documented = start(program)
    robot = start_robot("--late", "0.08", "--sent", tmp_path / "sent.json")
    robot.wait_for("played")
    documented.wait_for(" m, ")
    wait_until(lambda: listener.said("joints")[0] == ERROR)  # it is over, and that is said
    assert node.end() == 0, node.text
    assert len(listener.poses) > 100
    found = assert_replay_gives_the_poses([path], listener.poses)
    estimates = list(found.values())
    assert sum(e.faults == () for e in estimates) > 0.9 * len(estimates)  # a busy computer is late
    assert sum(e.status == "ok" for e in estimates) > 0.9 * len(estimates)
    late = [
        m.time - m.visual_time
        for m in read_recording(path).measurements("recorded")
        if m.T_wo_visual
    ]
    assert np.median(late) > 0.06
    truth = read_recording(grasp)
    shift = robot_offset(path, truth)
    errors = [
        np.linalg.norm(position(m) - T.translation())
        for m in listener.poses
        if (T := truth.truth_at((stamp_of(m) - shift) / 1e9)) is not None
    ]
    assert np.median(errors) < 0.004  # [m]
    shown = listener.markers[-1].markers
    assert [m.ns for m in shown] == ["object", "contacts"] and len(shown[1].points) >= 1
    latencies = 1000 * np.array(
        listener.latencies(json.loads((tmp_path / "sent.json").read_text()))
    )
    assert (latencies > 0.0).all()
    p50, p95 = np.percentile(latencies, [50, 95])
    inside = listener.said("estimate")[2]["latency p50, p95 [ms]"]
    print(f"last message to pose, p50 and p95: {p50:.1f}, {p95:.1f} ms; in the node {inside}")


def robot_offset(path, truth):
    """What the robot added to the recording's stamps [ns]: its joints' values are found again."""
    sent = read_recording(path).streams.joints.columns["thumb_middle"]
    told = truth.streams.joints.columns["thumb_middle"]
    k = len(sent[0]) // 2
    return int(sent[0][k] - told[0][np.flatnonzero(told[1] == sent[1][k])[0]])


def test_publishers_that_are_killed_are_named_and_come_back(start_node, start_robot, listener):
    node = start_node()
    parts = {
        part: start_robot("--name", part, "--only", part) for part in ("joints", "wrist", "vision")
    }
    skin = start_robot("--name", "skin", "--only", "contacts")
    wait_until(lambda: len(listener.poses) > 20)
    skin.end(signal.SIGKILL)
    wait_until(lambda: listener.said("contacts")[0] == ERROR)
    assert "/other/skin is silent" in listener.said("contacts")[1]
    wait_until(lambda: "nothing was fused" in listener.said("estimate")[1])
    for robot in parts.values():
        robot.end(signal.SIGKILL)
    count = len(listener.poses)
    start_robot("--name", "again")
    wait_until(lambda: len(listener.poses) > count + 20)
    wait_until(lambda: listener.said("contacts")[1] == "fine")
    assert node.end(signal.SIGTERM) == 0, node.text


def test_garbage_and_a_second_robot_hurt_nobody(start_node, start, start_robot, listener, tmp_path):
    path = tmp_path / "run.mcap"
    node = start_node("--record", path)
    start(HERE / "garbage.py").wait_for("ready")
    start_robot("--name", "first")
    start_robot("--name", "second")
    wait_until(lambda: len(listener.poses) > 150)
    assert "could not be used" in listener.said("joints")[1]
    assert "could not be used" in listener.said("vision")[1]
    count = len(listener.poses)
    wait_until(lambda: len(listener.poses) > count)
    assert node.end() == 0, node.text
    # Garbage may have come first, and the robot's clock then went back by years.
    assert_replay_gives_the_poses(tmp_path.glob("*.mcap"), listener.poses)
    assert all(np.isfinite(position(m)).all() for m in listener.poses)


def test_a_clock_that_jumps_begins_anew_in_another_recording(
    start_node, start_robot, listener, tmp_path
):
    path = tmp_path / "run.mcap"
    node = start_node("--record", path)
    day = 86400 * 10**9
    start_robot("--stamps", str(20_000 * day), "--seconds", "4").wait_for("played")
    assert "stamps are by a clock" in listener.said("estimate")[1]
    count = len(listener.poses)
    assert count > 30
    start_robot("--stamps", str(19_999 * day), "--seconds", "4").wait_for("played")
    wait_until(lambda: len(listener.poses) > count + 30)
    assert node.end() == 0, node.text
    assert "went back by 8640" in node.text
    days = [stamp_of(m) // day for m in listener.poses]
    assert_replay_gives_the_poses(
        [path], [m for m, d in zip(listener.poses, days, strict=True) if d == 20_000]
    )
    again = tmp_path / "run_1.mcap"
    assert_replay_gives_the_poses(
        [again], [m for m, d in zip(listener.poses, days, strict=True) if d == 19_999]
    )


def test_simulated_time_is_the_nodes(start_node, start_robot, listener):
    node = start_node("--ros-args", "-p", "use_sim_time:=true")
    start_robot("--sim", "--stamps", "1000000000", "--rate", "0.5", "--seconds", "3").wait_for(
        "played"
    )
    wait_until(lambda: len(listener.poses) > 30)
    assert all(10**9 <= stamp_of(m) <= 20 * 10**9 for m in listener.poses)
    assert "stamps are by a clock" not in listener.said("estimate")[1]
    assert node.end() == 0, node.text


def test_services_reset_and_record(start_node, start_robot, listener, tmp_path):
    path = tmp_path / "asked.mcap"
    node = start_node("--ros-args", "-p", f"record:={path}")
    assert not listener.call("start_recording").success  # it is recorded from the beginning
    assert listener.call("stop_recording").success
    start_robot()
    wait_until(lambda: len(listener.poses) > 50)
    assert listener.call("start_recording").message.endswith("asked_1.mcap")
    assert listener.call("restart_from_vision").success
    wait_until(lambda: listener.said("estimate")[2].get("begun anew") == "1")
    assert listener.call("reset").success
    count = len(listener.poses)
    wait_until(lambda: len(listener.poses) > count + 20)
    assert listener.call("stop_recording").success
    assert node.end() == 0, node.text
    last = sorted(tmp_path.glob("asked_*.mcap"))[-1]
    stamps = set(replayed(last))
    assert_replay_gives_the_poses([last], [m for m in listener.poses if stamp_of(m) in stamps])


def test_a_calibration_is_used_and_a_latched_wrist_is_enough(
    start, start_robot, listener, tmp_path, topics, grasp
):
    hand = load_hand("isyhand")
    zeros = {name: 0.02 for name in hand.joint_names}
    calibration = Calibration(
        robot=Robot.of(read_recording(grasp)),
        camera=np.full(6, 1e-3),
        camera_origin=np.zeros(3),
        joint_zeros=zeros,
        covariance=1e-6 * np.eye(6 + len(zeros)),
    )
    file = tmp_path / "calibration.yaml"
    calibration.to_yaml(file)
    robot = start_robot("--only", "wrist", "--seconds", "0.005")  # once, before the node is there
    robot.wait_for("ready")
    path = tmp_path / "run.mcap"
    node = start(
        "-m", "vtgtsam.cli", "ros", "--topics", topics, "--calibration", file, "--record", path
    )
    node.wait_for("poses on /vtgtsam/object_pose")
    start_robot("--name", "rest", "--only", "joints,contacts,vision", "--seconds", "4")
    wait_until(lambda: len(listener.poses) > 30)
    assert node.end() == 0, node.text
    assert_replay_gives_the_poses([path], listener.poses)
    assert read_recording(path).calibrations[0].joint_zeros == zeros


def test_a_node_that_calibrates_keeps_what_it_found_and_its_poses_can_be_replayed(
    start_node, start_robot, listener, tmp_path
):
    path, kept = tmp_path / "run.mcap", tmp_path / "robot.yaml"
    node = start_node("--calibration-out", kept, "--record", path)
    start_robot("--seconds", "5").wait_for("played")
    wait_until(lambda: len(listener.poses) > 90)
    assert node.end() == 0, node.text
    assert f"Wrote {kept}" in node.text
    found = Calibration.from_yaml(kept)
    recording = read_recording(path)
    assert recording.calibrations.first is None
    assert found.made_from == (f"run of {recording.info['started']}",)
    assert_replay_gives_the_poses([path], listener.poses)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("--calibrate", "--config", "simulation"), "calibrating needs settings with memory"),
        (("--calibration-out", __file__), f"{__file__} is there already"),
        (("--hand", "nohand"), "nohand"),
        (("--record", "/no/such/run.mcap"), "there is no folder /no/such"),
        (("--bogus",), "ROS's own arguments follow --ros-args"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(start, topics, change, sentence):
    node = start("-m", "vtgtsam.cli", "ros", "--topics", topics, *change)
    assert node.wait() in (1, 2)
    assert sentence in node.text
    assert "Traceback" not in node.text


@pytest.mark.slow
def test_ten_minutes_do_not_let_it_grow(start_node, start_robot, listener):
    node = start_node()
    sizes = []
    for _ in range(50):  # grasps of 12 s
        count = len(listener.poses)
        start_robot().wait_for("played")
        assert len(listener.poses) > count
        sizes.append(resident(node._process.pid))
        listener.poses.clear(), listener.diagnostics.clear(), listener.markers.clear()
    assert sizes[-1] - sizes[9] < 10e6  # [bytes], after two minutes
    assert node.end() == 0


def resident(pid):
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096

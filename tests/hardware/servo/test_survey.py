# SPDX-License-Identifier: MIT
from __future__ import annotations

import time

import numpy as np
import pytest
import yaml

from hardware.commands.joints import off, reboot
from hardware.emulate.servo import OVERLOAD
from hardware.servo.bus import Bus, BusError, ServoError
from hardware.servo.description import DATA, load_description
from hardware.servo.survey import (
    JointCalibrationError,
    JointWizard,
    first_of,
    let_go,
    moved_zeros,
    save_zeros,
    survey,
    table,
    with_zeros,
)
from vtgtsam.exceptions import VtgtsamError

TEXT = (DATA / "isyhand.yaml").read_text(encoding="utf-8")
TICK = 360.0 / 4096  # [degrees]


@pytest.fixture
def bus(description, line):
    names = {joint.id: joint.name for joint in description.joints}
    with Bus(line.path, description.baud, names) as bus:
        yield bus


def test_the_table_shows_every_joint_and_what_is_wrong(description, line, bus):
    first = survey(bus, description)
    line.plant.place(13, 2048.0 - 1024)
    with line.lock:
        line.servos[12].fail(OVERLOAD)
        line.servos[51].set("torque_enable", 1)
        line.servos[51].set("present_input_voltage", 39)
    line.plant.place(22, 2048.0 + 500)
    line.faults.silent = {41}
    time.sleep(0.05)
    rows = dict(
        zip(description.joint_names, table(survey(bus, description), first)[1:], strict=True)
    )
    assert "1024    90.0°" in rows["index_proximal"] and "90.0°" in rows["index_proximal"][45:]
    assert rows["index_middle"].endswith("overload")
    assert "3.9V     ON" in rows["palm_inner"]
    assert rows["thumb_middle"].endswith("outside its limits")
    assert rows["ring_distal"].split() == ["ring_distal", "41", "no", "answer"]
    assert rows["ring_middle"].split()[:3] == ["ring_middle", "42", "2048"]  # it hides no other


def test_a_joint_that_answers_late_has_not_moved_by_nothing(description, line, bus):
    line.faults.silent = {41}
    first = survey(bus, description)
    line.faults.silent = set()
    now = survey(bus, description)
    row = table(now, first)[1 + description.joint_names.index("ring_distal")]
    assert "nan" not in row and "28°C" in row
    line.plant.place(41, 2048.0 + 512)
    time.sleep(0.05)
    later = table(survey(bus, description), first_of(first, now))
    assert "45.0°" in later[1 + description.joint_names.index("ring_distal")][45:]


def test_torque_that_a_killed_program_left_goes_off_and_the_missing_are_named(
    description, line, capsys
):
    with line.lock:
        for servo in line.servos.values():
            servo.set("torque_enable", 1)
    line.faults.silent = {11}
    off(servos=line.path)
    out = capsys.readouterr().out
    assert "torque is off at 14 of 15 servos" in out
    assert "no answer from index_distal (servo 11)" in out
    assert [i for i, servo in line.servos.items() if servo.torque] == [11]


def test_off_says_to_cut_the_power_where_nobody_answers(description, line, bus):
    line.faults.silent = set(line.servos)
    with pytest.raises(BusError, match="no servo answers .* cut the power"):
        let_go(bus, description)


def test_reboot_restarts_those_with_an_error_and_says_which(description, line, capsys):
    with line.lock:
        line.servos[12].fail(OVERLOAD)
    before = [servo.get("realtime_tick") for servo in line.servos.values()]
    reboot(servos=line.path)
    out = capsys.readouterr().out
    assert "index_middle (servo 12) reports overload: restarted" in out
    assert out.count("restarted") == 1
    assert not line.servos[12].alert
    assert len(before) == 15
    reboot(servos=line.path)
    assert "no servo reports a hardware error" in capsys.readouterr().out
    with pytest.raises(ServoError, match="no joints thumb_mid; there are: thumb_rotation"):
        reboot(servos=line.path, joint=["thumb_mid"])


class Person:
    """Turns joints as the wizard asks; the hand's true zeros and signs are another hand's."""

    def __init__(self, line, truth, typed=None):
        self.line, self.truth, self.typed = (
            line,
            {joint.label: joint for joint in truth},
            typed or {},
        )
        self.said, self.asked = [], 0

    def __call__(self, question):
        self.asked += 1
        label = question.split("] ")[1].split(":")[0]
        answer = self.typed.get(self.asked, "")
        if answer in ("s", "q"):
            return answer
        joint = self.truth[label]
        angle = 0.0 if "hold it" in question else float(question.split("[")[-1].split("]")[0])
        ticks = joint.zero + joint.sign * (float(answer) if answer else angle) / TICK
        self.line.plant.place(joint.id, ticks)
        time.sleep(0.03)
        return answer


def wizard(description, bus, person):
    return JointWizard(
        joints=description.joints,
        count=lambda joint: bus.read(joint.id, "present_position"),
        ask=person,
        say=person.said.append,
        positive={"index_proximal": "closes the hand"},
    )


def test_zeros_and_signs_are_found_wherever_they_lie(description, line, bus):
    rng = np.random.default_rng(0)
    truth = [
        joint.model_copy(update={"zero": int(zero), "sign": int(sign)})
        for joint, zero, sign in zip(
            description.joints,
            [0, 10, 4095, 4000, *rng.integers(0, 4096, 11)],
            rng.choice([-1, 1], 15),
            strict=True,
        )
    ]
    person = Person(line, truth)
    found = wizard(description, bus, person).run()
    for joint in truth:
        assert found[joint.name].sign == joint.sign, joint.name
        apart = (found[joint.name].zero - joint.zero + 2048) % 4096 - 2048
        assert abs(apart) <= 1, joint.name


def test_the_wizard_refuses_marks_that_cannot_be_right(description, line, bus):
    # The fourth answer claims 90 degrees where the joint stays; the sixth and later skip.
    person = Person(
        line, description.joints, typed={2: "3", 3: "s", 4: "s"} | dict.fromkeys(range(5, 40), "s")
    )
    found = wizard(description, bus, person).run()
    assert found == {}
    assert any("marks are 3 degrees apart: 15 or more" in text for text in person.said)


def test_the_wrong_joint_is_noticed(description, line, bus):
    class Confused(Person):
        def __call__(self, question):
            if "positive" in question:
                self.line.plant.place(24, 2048)  # the other joint moves
                self.asked += 1
                return "" if self.asked < 4 else "q"
            return super().__call__(question)

    person = Confused(line, description.joints)
    with pytest.raises(VtgtsamError, match="given up"):
        wizard(description, bus, person).run()
    assert any(
        "counts 0 degrees between marks 64 degrees apart: is it this joint" in t
        for t in person.said
    )


@pytest.mark.parametrize(("zero", "sign"), [(2048, 1), (2048, -1), (4090, 1), (3, -1)])
def test_after_zeros_are_moved_by_an_offset_a_joint_reads_less_by_it(description, zero, sign):
    joint = description.joints[4].model_copy(update={"zero": zero, "sign": sign})
    (moved,) = moved_zeros([joint], {joint.name: 0.05}).values()
    assert 0 <= moved.zero < 4096
    for ticks in (zero - 300, zero, zero + 100):
        read_less = joint.angle(ticks) - moved.angle(ticks)
        assert read_less == pytest.approx(0.05, abs=np.deg2rad(TICK / 2))


def test_offsets_of_a_joint_that_the_hand_has_not_are_refused(description):
    with pytest.raises(JointCalibrationError, match="no joints wheel; there are: thumb_rotation"):
        moved_zeros(description.joints, {"thumb_rotation": 0.0, "wheel": 0.1})


def test_the_hands_file_is_changed_in_these_numbers_alone(description, tmp_path):
    joint = description.joints[4].model_copy(update={"zero": 77, "sign": 1})
    (tmp_path / "isyhand.yaml").write_text(TEXT, encoding="utf-8")
    save_zeros(tmp_path / "isyhand.yaml", tmp_path / "mine.yaml", {joint.name: joint})
    text = (tmp_path / "mine.yaml").read_text(encoding="utf-8")
    changed = [(a, b) for a, b in zip(TEXT.split("\n"), text.split("\n"), strict=True) if a != b]
    assert len(changed) == 1 and "index_proximal" in changed[0][1]
    read = load_description(tmp_path / "mine.yaml").joints[4]
    assert (read.zero, read.sign) == (77, 1)
    block = yaml.safe_dump(yaml.safe_load(TEXT))  # the same file in another style
    assert yaml.safe_load(with_zeros(block, {joint.name: joint}))["joints"][4]["zero"] == 77
    with pytest.raises(ValueError, match="no entries of joints nobody"):
        with_zeros(TEXT, {"nobody": joint.model_copy(update={"name": "nobody"})})
    with pytest.raises(ValueError, match="no entries of joints"):
        with_zeros("# nothing yet\n", {joint.name: joint})

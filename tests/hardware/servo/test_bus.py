# SPDX-License-Identifier: MIT
from __future__ import annotations

import threading
import time

import pytest

from hardware.emulate.packets import status
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.bus import Bus, BusError, NoAnswerError, ServoError
from hardware.servo.setup import find_servos
from hardware.servo.table import STATE, Block

BAUD = 1_000_000
IDS = [11, 12, 13]
POSITION = Block(["present_position"])


@pytest.fixture
def line():
    with ServoLineEmulator(IDS, BAUD) as emulator:
        for servo_id, position in zip(IDS, (1000, 2000, 3000), strict=True):
            emulator.plant.place(servo_id, position)
        yield emulator


@pytest.fixture
def bus(line):
    with Bus(line.path, BAUD, {11: "index_distal"}) as bus:
        yield bus


def complete(bus, block=POSITION, count=3):
    """A sync read that ``count`` servos answered; a busy test machine may starve the emulator."""
    for _ in range(20):
        read = bus.sync_read(IDS, block)
        if len(read.answers) >= count:
            break
    return read


def positions(read):
    return {i: answer.values["present_position"] for i, answer in read.answers.items()}


def test_registers_are_written_and_read(line, bus):
    bus.write(11, "goal_current", -100)
    assert bus.read(11, "goal_current") == -100
    assert line.servos[11].get("goal_current") == -100
    assert bus.read(12, "goal_current") == 1750


def test_many_are_written_and_read_at_once(line, bus):
    bus.sync_write("position_p_gain", {11: 1, 12: 2, 13: 3})
    read = complete(bus)
    assert positions(read) == {11: 1000, 12: 2000, 13: 3000}
    assert read.start < read.time < read.end
    assert [line.servos[i].get("position_p_gain") for i in IDS] == [1, 2, 3]


def test_a_ping_gives_model_and_firmware(bus):
    assert bus.ping(12) == (1200, 52)


def test_silence_names_servo_port_and_rate(line, bus):
    line.faults.silent = {11}
    with pytest.raises(NoAnswerError, match=r"index_distal \(servo 11\).*/dev/.* 1000000 baud"):
        bus.read(11, "led", attempts=1)


def test_a_refusal_names_servo_register_and_reason(bus):
    bus.write(11, "torque_enable", 1)
    with pytest.raises(ServoError, match=r"index_distal.*locked while torque.*operating_mode := 5"):
        bus.write(11, "operating_mode", 5)
    bus.write(12, "current_limit", 300)
    with pytest.raises(ServoError, match=r"servo 12 says.*beyond a limit \(goal_current := 301\)"):
        bus.write(12, "goal_current", 301)


def test_a_servo_with_a_hardware_error_can_still_be_asked(line, bus):
    line.servos[12].fail(1 << 5)
    assert bus.read(12, "hardware_error_status") == 1 << 5
    answers = complete(bus).answers
    assert {i: answer.alert for i, answer in answers.items()} == {11: False, 12: True, 13: False}


def test_a_late_answer_to_an_earlier_question_is_passed_by(line, bus):
    """What the SDK's own read may return here is 176, the low byte of the model number."""
    for _ in range(20):
        line.inject(status(11, 0, bytes.fromhex("b004")))
        assert bus.read(11, "present_temperature") == 28
    assert bus.traffic.foreign > 0


def test_what_is_distrusted_does_not_answer_the_next_question(line, bus):
    """A whole cycle's answers that come too late look like those of the next cycle."""
    late = b"".join(status(i, 0, (7).to_bytes(4, "little")) for i in IDS)

    def read(distrust):
        complete(bus)
        line.inject(late, delay=0.004)
        if distrust:
            bus.distrust()
        return positions(bus.sync_read(IDS, POSITION))

    # Not all of them: a busy test machine may let the late ones come later still.
    assert sum(read(distrust=False) == {11: 7, 12: 7, 13: 7} for _ in range(8)) > 4
    assert sum(read(distrust=True) == {11: 1000, 12: 2000, 13: 3000} for _ in range(8)) > 4


def test_an_answer_of_the_wrong_length_or_id_is_no_answer(line, bus):
    line.faults.drop = 1.0
    results = []

    def ask():
        with pytest.raises(NoAnswerError) as caught:
            bus.read(11, "present_temperature", attempts=1)
        results.append(caught)

    thread = threading.Thread(target=ask)
    thread.start()
    time.sleep(0.01)
    line.inject(status(11, 0, b"\xb0\x04"))
    line.inject(status(12, 0, b"\x21"))
    line.inject(status(11, 0))
    thread.join()
    assert len(results) == 1
    assert bus.traffic.foreign == 3


def test_an_acknowledgement_is_not_taken_from_a_late_reading(line, bus):
    line.faults.lost_instruction = 1.0
    results = []

    def tell():
        with pytest.raises(NoAnswerError) as caught:
            bus.write(11, "torque_enable", 0, attempts=1)
        results.append(caught)

    thread = threading.Thread(target=tell)
    thread.start()
    time.sleep(0.01)
    line.inject(status(11, 0, b"\x00\x08\x00\x00"))
    thread.join()
    assert results


def test_one_silent_servo_neither_hides_others_nor_becomes_zero(line, bus):
    line.faults.silent = {13}
    assert positions(complete(bus, count=2)) == {11: 1000, 12: 2000}
    line.faults.silent = {12}  # real servos after an absent one keep silent as well
    assert positions(complete(bus, count=1)) == {11: 1000}
    line.faults.silent = set()
    assert positions(complete(bus)) == {11: 1000, 12: 2000, 13: 3000}


def test_data_that_looks_like_a_header_comes_through(line, bus):
    servo = line.servos[12]
    line.plant.advance = lambda dt, drives: {}
    with line.lock:
        servo.set("present_current", -1)
        servo.set("present_velocity", -3)
    values = complete(bus, STATE).answers[12].values
    assert (values["present_current"], values["present_velocity"]) == (-1, -3)


def test_a_value_the_sdk_unstuffs_wrongly_is_no_answer(line, bus):
    """The SDK (4.1) takes a byte too many from FF FF FD ... 00 FF FD FD."""
    line.plant.advance = lambda dt, drives: {}
    with line.lock:
        line.servos[12].set("present_current", -1)
        line.servos[12].set("present_velocity", -3)
        line.servos[12].set("position_trajectory", 0x00FDFDFF)
    assert set(complete(bus, STATE, count=2).answers) == {11, 13}


def test_an_interrupted_transaction_leaves_the_line_in_order(line, bus):
    class Interrupting:
        def __init__(self, packets):
            self.packets = packets

        def txPacket(self, *arguments):
            self.packets.txPacket(*arguments)
            raise KeyboardInterrupt

    packets, bus._packets = bus._packets, Interrupting(bus._packets)
    with pytest.raises(KeyboardInterrupt):
        bus.read(11, "model_number")
    bus._packets = packets
    assert bus.read(11, "present_temperature") == 28
    assert positions(complete(bus)) == {11: 1000, 12: 2000, 13: 3000}


def test_threads_take_turns(line, bus):
    wrong = []

    def ask(servo_id, position):
        for _ in range(50):
            if bus.read(servo_id, "present_position") != position:
                wrong.append(servo_id)
            if positions(bus.sync_read(IDS, POSITION)).get(servo_id, position) != position:
                wrong.append(servo_id)

    threads = [
        threading.Thread(target=ask, args=pair)
        for pair in zip(IDS, (1000, 2000, 3000), strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_statistics_count_what_was_lost(line, bus):
    for _ in range(4):
        bus.sync_read(IDS, POSITION)
    line.faults.silent = {13}
    before = time.monotonic()
    for _ in range(4):
        bus.sync_read(IDS, POSITION)
    assert bus.traffic.asked[13] == 8
    assert bus.traffic.lost(13) >= 0.5 > bus.traffic.lost(11)
    assert bus.traffic.last_answer[13] < before < bus.traffic.last_answer[11]
    assert bus.traffic.diagnosis(bus.label).startswith("answers lost (no packets at all): servo 13")


def test_an_unplugged_adapter_is_a_bus_error_at_once(line, bus):
    line.unplug()
    start = time.monotonic()
    for action in (
        lambda: bus.read(11, "led"),
        lambda: bus.write(11, "led", 1),
        lambda: bus.sync_write("led", {11: 1}),
        lambda: bus.sync_read(IDS, POSITION),
    ):
        with pytest.raises(BusError, match="/dev/.* failed .*check its cable"):
            action()
    assert time.monotonic() - start < 0.5


def test_a_closed_bus_says_so(line):
    bus = Bus(line.path, BAUD)
    bus.close()
    with pytest.raises(BusError, match="closed"):
        bus.ping(11)


def test_a_second_bus_on_the_same_port_is_refused(line, bus):
    with pytest.raises(BusError, match="another program has /dev/.* open"):
        Bus(line.path, BAUD)
    assert bus.ping(11) == (1200, 52)


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(BusError, match="no port /dev/nothing_there"):
        Bus("/dev/nothing_there", BAUD)


def test_servos_at_another_rate_do_not_hear(line):
    with Bus(line.path, 57600) as slow, pytest.raises(NoAnswerError, match="57600"):
        slow.ping(11, attempts=1)
    with Bus(line.path, BAUD) as bus:
        assert bus.ping(11) == (1200, 52)
    with line.lock:
        line.servos[11].set("baud_rate", 1)
    with Bus(line.path, 57600) as slow:
        assert slow.ping(11) == (1200, 52)


def test_servos_are_found_at_whatever_rate_they_are():
    with ServoLineEmulator([1, 2], 57600) as line:
        with line.lock:
            line.servos[2].set("baud_rate", 5)
        assert find_servos(line.path, [1, 2, 3]) == {57600: {1: 1200}, 3_000_000: {2: 1200}}

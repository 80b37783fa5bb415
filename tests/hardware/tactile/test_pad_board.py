# SPDX-License-Identifier: MIT
"""The board's reader on a real pseudo terminal, read from the emulated board."""

import os
import time
import tty

import numpy as np
import pytest
from pad_hand import PADS, EmulatedPads

from hardware.emulate.pad_signal import PadSignal, bench_scale, pad_parameters
from hardware.emulate.pads import PadBoardEmulator
from hardware.servo.description import load_description
from hardware.tactile.board import BoardCounts, FrameTimer, PadBoard, PadBoardError
from hardware.tactile.frame import Frame, encode
from hardware.tactile.pressure import BoardPads

RATE = 500.0  # [Hz], ten times the real board's, so that few seconds hold many frames


def no_forces(_):
    return np.zeros(len(PADS)), np.zeros(len(PADS))


@pytest.fixture
def emulator():
    pads = EmulatedPads(0)
    with PadBoardEmulator(pads.wiring, pads.signal, no_forces, rate=RATE) as board:
        yield board


def wait_until(condition, seconds=5.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.005)


def test_readings_arrive_with_the_instant_at_which_they_were_measured(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        before = time.monotonic()
        values = board.record(0.5)
        readings = board.since(before)
    assert values.shape[1] == 14 and len(values) > 100
    times = np.array([reading.time for reading in readings])
    assert (np.diff(times) >= 0).all() and (times <= time.monotonic()).all()
    assert np.ptp(times) / (len(times) - 1) == pytest.approx(1 / RATE, rel=0.3)  # busy machines
    assert values.mean(axis=0) == pytest.approx(0.5 * 65535, rel=0.05)  # reference = pad at rest


def test_what_the_port_kept_from_before_is_not_taken_for_new(emulator):
    time.sleep(0.3)
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        assert board.since(0.0)[0].board_time > 0.25


def test_forces_reach_the_reader():
    pads = EmulatedPads(1)
    force = np.zeros(len(PADS))
    with PadBoardEmulator(
        pads.wiring, pads.signal, lambda _: (force, 0 * force), rate=RATE
    ) as emulator:
        with PadBoard(emulator.path, inputs=14) as board:
            rest = pads.wiring.resistance(board.record(0.2)).mean(axis=0)
            force[5] = 6.0
            time.sleep(0.05)
            pressed = pads.wiring.resistance(board.record(0.2)).mean(axis=0)
    fall = 1 - pressed / rest
    assert fall[5] == pytest.approx(pads.parameters.drop[5], rel=0.1)
    assert np.abs(np.delete(fall, 5)).max() < 0.02


def test_damage_on_the_line_is_counted_and_never_becomes_a_reading(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        faults = emulator.faults
        faults.drop = faults.corrupt = faults.truncate = faults.garbage = 0.05
        start = emulator.sent
        values = board.record(1.0)
        wait_until(lambda: emulator.sent > start + 200)
        faults.drop = faults.corrupt = faults.truncate = faults.garbage = 0.0
        board.record(0.1)
        link = board.counts()
    # A wrong value would stand out: at rest all inputs stay within some per cent of the middle.
    assert np.abs(values / 65535 - 0.5).max() < 0.05
    assert link.bad > 5
    assert link.lost > link.bad  # those dropped whole are missing too
    assert 0.05 < link.lost / (link.lost + link.frames) < 0.30  # each fault costs a frame or two


def test_a_silent_board_shows_by_the_age_of_its_last_reading(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        emulator.faults.silent = True
        time.sleep(0.3)
        assert time.monotonic() - board.latest().time > 0.2
        emulator.faults.silent = False
        wait_until(lambda: time.monotonic() - board.latest().time < 0.05)
        assert board.counts().lost > 50


def test_a_board_that_repeats_itself_counts_as_silent(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        emulator.faults.frozen = True
        time.sleep(0.3)
        assert time.monotonic() - board.latest().time > 0.2


def test_recording_a_silent_board_fails_with_a_reason(emulator):
    emulator.faults.silent = True
    time.sleep(0.05)
    with PadBoard(emulator.path, inputs=14) as board:
        with pytest.raises(
            PadBoardError, match=r"sent 0 readings in 0.2 s; nothing arrives: is it"
        ):
            board.record(0.2)


def test_an_unplugged_board_is_a_typed_error_at_once(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        emulator.unplug()
        start = time.monotonic()
        with pytest.raises(PadBoardError, match=rf"lost the pad board on {emulator.path}"):
            while time.monotonic() < start + 2.0:
                board.latest()
                time.sleep(0.005)
        assert time.monotonic() - start < 0.5


def test_a_board_that_restarts_is_followed(emulator):
    with PadBoard(emulator.path, inputs=14) as board:
        board.wait()
        time.sleep(0.2)
        emulator.restart()
        wait_until(lambda: board.counts().restarts == 1)
        assert board.latest().board_time < 1.0
        assert abs(time.monotonic() - board.latest().time) < 0.2


def test_a_board_with_another_number_of_inputs_is_refused(emulator):
    with PadBoard(emulator.path, inputs=16) as board:
        with pytest.raises(PadBoardError, match="has 14 inputs, the hand's description 16"):
            board.wait()


def test_something_else_than_a_pad_board_is_diagnosed():
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        with PadBoard(os.ttyname(slave), inputs=14) as board:
            assert "nothing arrives" in board.counts().diagnosis()
            for _ in range(20):
                os.write(master, b"temperature,21.3\r\n")
            wait_until(lambda: board.counts().bytes > 300)
            with pytest.raises(PadBoardError, match="no frame: another device, another baud rate"):
                board.wait(0.1)
    finally:
        os.close(master)
        os.close(slave)


def test_a_port_that_is_not_there_is_an_error_that_says_what_to_check():
    with pytest.raises(PadBoardError, match=r"cannot open the pad board on /dev/none.*dialout"):
        PadBoard("/dev/none", inputs=14)


def test_a_port_that_is_in_use_is_refused(emulator):
    with PadBoard(emulator.path, inputs=14):
        with pytest.raises(PadBoardError, match="no other program"):
            PadBoard(emulator.path, inputs=14)


def test_a_good_line_has_nothing_to_complain_about():
    assert BoardCounts(bytes=45_000, frames=1000, bad=1, lost=2).diagnosis() == ""
    assert "70 of 1070 frames were lost" in BoardCounts(1, 1000, 9, 70).diagnosis()
    assert "restarted 2 times" in BoardCounts(1, 1000, 0, 0, restarts=2).diagnosis()


def frames(*pairs):
    return [Frame(sequence, time_us, (7,)) for sequence, time_us in pairs]


def test_missing_frames_are_counted_across_the_end_of_the_sequence():
    timer = FrameTimer()
    sent = frames((65533, 0), (65534, 20_000), (1, 80_000), (2, 100_000))
    for frame in sent:
        timer.reading(frame, frame.board_time_us * 1e-6)
    assert timer.lost == 2 and timer.restarts == 0


def test_the_board_s_clock_goes_on_when_its_32_bits_are_full():
    timer = FrameTimer()
    start = 2**32 - 30_000
    instants = [
        timer.reading(Frame(i, (start + 20_000 * i) % 2**32, (7,)), 50.0 + 0.02 * i)
        for i in range(4)
    ]
    assert timer.restarts == 0
    np.testing.assert_allclose([r.time for r in instants], 50.0 + 0.02 * np.arange(4), atol=1e-9)
    assert instants[-1].board_time == pytest.approx((start + 60_000) * 1e-6)


@pytest.mark.parametrize("uptime_s", [10, 1000, 3000, 4200])  # around half of the clock's range
def test_a_restart_is_seen_however_long_the_board_had_run(uptime_s):
    timer = FrameTimer()
    timer.reading(Frame(500, uptime_s * 1_000_000, (7,)), 100.0)
    reading = timer.reading(Frame(3, 60_000, (7,)), 100.8)
    assert timer.restarts == 1 and timer.lost == 0
    assert reading.time == pytest.approx(100.8) and reading.board_time == pytest.approx(0.06)


def test_a_host_that_sleeps_does_not_look_like_a_restart():
    timer = FrameTimer()
    for i in range(200):
        received = 0.02 * i if not 50 <= i < 150 else 3.0  # frames 50 to 149 arrive at once
        timer.reading(Frame(i, 20_000 * i, (7,)), received)
    assert timer.restarts == 0 and timer.lost == 0


def test_a_burst_of_bytes_gives_its_frames_their_own_instants():
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        with PadBoard(os.ttyname(slave), inputs=1) as board:
            burst = b"".join(encode(Frame(i, 20_000 * i, (i,))) for i in range(10))
            os.write(master, b"\0" + burst)
            wait_until(lambda: board.counts().frames == 10)
            assert np.ravel([r.values for r in board.since(0.0)]).tolist() == list(range(10))
    finally:
        os.close(master)
        os.close(slave)


def test_what_went_wrong_with_board_and_wires_is_told(caplog):
    wiring = load_description("isyhand").pads
    names = tuple(wiring.pad_names)
    seed = np.random.SeedSequence(0)
    parameters = pad_parameters(wiring, seed)
    signal = PadSignal(parameters, np.random.default_rng(0))
    still = np.zeros(len(names))
    with PadBoardEmulator(wiring, signal, lambda t: (still, still)) as emulator:
        with BoardPads(emulator.path, wiring, bench_scale(wiring, parameters), names) as pads:
            assert pads.prepare() == "baseline of 16 pads measured"
            start = time.monotonic()
            emulator.faults.opened = (5,)
            wait_until(lambda: len(pads.since(start)) > 5)
            assert pads.remarks()[0].startswith("pad_index_distal was open or shorted in ")
            assert (
                caplog.text.count("pad_index_distal is open or shorted") == 1
            )  # once, not 50 times a second
            assert not pads.since(start)[-1][1].contacts[names.index("pad_index_distal")]
            emulator.restart()
            wait_until(lambda: any("restarted once" in text for text in pads.remarks()))

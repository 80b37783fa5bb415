# SPDX-License-Identifier: MIT
import numpy as np

from hardware.device_clock import DeviceClock


def arrivals(rng, count=2000, period=0.02, rate=1.0, offset=100.0):
    """Device stamps, true host instants, and arrivals with the delays of a USB line [s]."""
    host = offset + period * np.arange(count)
    delay = 0.001 + rng.exponential(0.002, count) + 0.05 * (rng.random(count) < 0.01)
    received = np.maximum.accumulate(host + delay)  # a serial line keeps the order
    return (host - offset) * rate, host, received


def test_delays_of_the_line_hardly_reach_the_stamps():
    device, host, received = arrivals(np.random.default_rng(0))
    clock = DeviceClock()
    error = np.array([clock.to_host(*pair) for pair in zip(device, received, strict=True)]) - host
    assert abs(np.median(error[50:]) - 0.001) < 0.0005  # the least delay stays inside
    assert np.abs(error[50:] - 0.001).max() < 0.001


def test_a_clock_that_runs_wrong_by_half_a_percent_is_followed():
    for rate in (0.995, 1.005):
        device, host, received = arrivals(np.random.default_rng(1), rate=rate)
        clock = DeviceClock()
        stamps = np.array([clock.to_host(*pair) for pair in zip(device, received, strict=True)])
        assert np.abs(stamps - host).max() < 0.055  # the first messages may all be late
        assert np.abs(stamps - host)[50:].max() < 0.010  # 0.5 % of the window's second, and delays


def test_stamps_neither_decrease_nor_lie_in_the_future():
    device, _, received = arrivals(np.random.default_rng(2), rate=1.001)
    received[300:340] = received[340]  # the host slept, everything arrives at once
    clock = DeviceClock()
    stamps = np.array([clock.to_host(*pair) for pair in zip(device, received, strict=True)])
    assert (np.diff(stamps) >= 0).all()
    assert (stamps <= received + 1e-12).all()


def test_a_clock_that_jumps_is_found_again_in_either_direction():
    for jump in (-5.0, 5.0):
        device, host, received = arrivals(np.random.default_rng(3))
        device = device + np.where(np.arange(len(device)) >= 200, jump, 0.0)
        clock = DeviceClock()
        stamps = np.array([clock.to_host(*pair) for pair in zip(device, received, strict=True)])
        assert np.abs(stamps - host)[210:].max() < 0.06  # [s], where 5 s were off
        assert np.abs(stamps - host)[50:200].max() < 0.02
        assert clock.jumps == (1 if jump < 0 else 0)  # ahead, the least difference tells it


def test_a_line_that_stalled_is_no_jump():
    device, host, received = arrivals(np.random.default_rng(4))
    received[200:240] = received[240]  # a hub held 40 messages back for 0.8 s
    clock = DeviceClock()
    stamps = np.array([clock.to_host(*pair) for pair in zip(device, received, strict=True)])
    assert clock.jumps == 0
    assert np.abs(stamps - host)[50:].max() < 0.02

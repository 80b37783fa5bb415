# SPDX-License-Identifier: MIT
import numpy as np
import pytest

tracker = pytest.importorskip("benchmarks.tracker")


def test_the_median_says_how_many_images_a_second():
    figures = tracker._figures(np.array([0.008] * 98 + [0.020] * 2))
    assert figures["median [ms]"] == pytest.approx(8.0)
    assert figures["99 % [ms]"] == pytest.approx(20.0)
    assert figures["images a second"] == pytest.approx(125.0)


@pytest.mark.slow
def test_each_camera_and_form_has_a_row():
    rows = tracker.measure("can")
    forms = [(row["camera"], row["tracker"]) for row in rows]
    every = [(camera, form) for camera in tracker.CAMERAS for form in tracker.FORMS]
    assert forms == [*every, ("stereo", "depth-hand, infrared")]
    assert all(0.0 < row["median [ms]"] <= row["99 % [ms]"] for row in rows)

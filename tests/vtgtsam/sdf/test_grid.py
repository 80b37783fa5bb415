# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import distance

from vtgtsam import GridSdf, VtgtsamError

LOWER, UPPER = np.array([-0.03, 0.01, -0.2]), np.array([0.05, 0.04, -0.1])


def random_grid(seed, shape=(4, 7, 5)):
    return GridSdf(np.random.default_rng(seed).normal(size=shape), LOWER, UPPER)


def points_around(seed, count=2000, reach=0.5):
    """Inside the grid and up to half its size outside."""
    rng = np.random.default_rng(seed)
    size = UPPER - LOWER
    return rng.uniform(LOWER - reach * size, UPPER + reach * size, (count, 3))


def test_value_and_gradient_agree_with_a_sum_over_the_eight_corners():
    sdf, points = random_grid(0), points_around(1)
    expected_value, expected_gradient = distance(sdf.values, sdf.lower, sdf.upper, points)
    value, gradient = sdf.value_and_gradient(points)
    np.testing.assert_allclose(value, expected_value, rtol=0, atol=1e-12)
    np.testing.assert_allclose(gradient, expected_gradient, rtol=1e-12, atol=1e-10)
    np.testing.assert_array_equal(sdf.value(points), value)


def test_value_at_the_nodes_is_the_stored_one():
    sdf = random_grid(2)
    axes = [np.linspace(LOWER[d], UPPER[d], sdf.values.shape[d]) for d in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(sdf.value(nodes), sdf.values.ravel(), atol=1e-12)


def test_linear_field_is_reproduced_with_its_gradient():
    slope = np.array([0.6, -0.48, 0.64])
    axes = [np.linspace(LOWER[d], UPPER[d], 9) for d in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    sdf = GridSdf(nodes @ slope + 0.01, LOWER, UPPER)
    points = points_around(3, reach=0.0)
    value, gradient = sdf.value_and_gradient(points)
    np.testing.assert_allclose(value, points @ slope + 0.01, atol=1e-7)  # nodes are float32
    np.testing.assert_allclose(gradient, np.tile(slope, (len(points), 1)), atol=1e-5)


def test_gradient_is_the_derivative_of_the_value():
    sdf, points, step = random_grid(4), points_around(5), 1e-9
    _, gradient = sdf.value_and_gradient(points)
    for axis in range(3):
        d = step * np.eye(3)[axis]
        slope = (sdf.value(points + d) - sdf.value(points - d)) / (2 * step)
        # A handful of the points straddle two cells or the grid's boundary, where it jumps.
        off = np.abs(slope - gradient[:, axis]) > 1e-4 * np.abs(gradient).max()
        assert off.mean() < 1e-3


def test_outside_the_distance_grows_by_the_distance_to_the_grid():
    sdf = random_grid(6)
    corner, beyond = UPPER, UPPER + [0.03, 0.04, 0.12]
    assert sdf.value([beyond])[0] == pytest.approx(sdf.value([corner])[0] + 0.13, abs=1e-12)
    _, gradient = sdf.value_and_gradient([beyond])
    np.testing.assert_allclose(gradient[0], np.array([0.03, 0.04, 0.12]) / 0.13, atol=1e-12)


def test_outside_one_side_the_other_axes_keep_their_slope():
    sdf = random_grid(7)
    on_side = np.array([[UPPER[0], 0.02, -0.15]])
    _, at_side = sdf.value_and_gradient(on_side)
    value, gradient = sdf.value_and_gradient(on_side + [[0.2, 0, 0]])
    assert value[0] == pytest.approx(sdf.value(on_side)[0] + 0.2, abs=1e-12)
    np.testing.assert_allclose(gradient[0], [1.0, at_side[0, 1], at_side[0, 2]], rtol=1e-9)


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    shift=st.tuples(*[st.floats(-1, 1)] * 3),
    shape=st.tuples(*[st.integers(2, 6)] * 3),
)
def test_moving_grid_and_points_together_changes_nothing(seed, shift, shape):
    values = np.random.default_rng(seed).normal(size=shape)
    here = GridSdf(values, LOWER, UPPER)
    there = GridSdf(values, LOWER + shift, UPPER + shift)
    points = points_around(seed, 20)
    value, gradient = here.value_and_gradient(points)
    # At cell boundaries rounding may choose the neighbouring cell: the value is continuous there,
    # its gradient is not.
    np.testing.assert_allclose(there.value(points + shift), value, atol=1e-9)
    moved = there.value_and_gradient(points + shift)[1]
    assert np.median(np.abs(moved - gradient)) < 1e-6 * max(1.0, np.abs(gradient).max())


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), normal=st.tuples(*[st.floats(-1, 1)] * 3))
def test_field_of_a_half_space_changes_no_faster_than_the_distance(seed, normal):
    normal = np.array(normal) + [0, 0, 2.0]
    normal /= np.linalg.norm(normal)
    axes = [np.linspace(LOWER[d], UPPER[d], 6) for d in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    sdf = GridSdf(nodes @ normal, LOWER, UPPER)
    a, b = points_around(seed, 50, reach=0.0), points_around(seed + 1, 50, reach=0.0)
    change = np.abs(sdf.value(a) - sdf.value(b))
    assert (change <= np.linalg.norm(a - b, axis=1) + 1e-7).all()  # nodes are float32


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_point_that_is_not_finite_gives_nan_and_spares_the_others(bad):
    sdf = random_grid(8)
    points = np.array([[0.0, 0.02, -0.15], [0.0, bad, -0.15], [0.01, 0.03, -0.12]])
    value, gradient = sdf.value_and_gradient(points)
    assert np.isnan(value[1]) and np.isnan(gradient[1]).all()
    np.testing.assert_array_equal(value[[0, 2]], sdf.value(points[[0, 2]]))
    assert np.isfinite(gradient[[0, 2]]).all()


def test_no_points_give_no_values():
    value, gradient = random_grid(9).value_and_gradient(np.empty((0, 3)))
    assert value.shape == (0,) and gradient.shape == (0, 3)


def test_save_and_load_give_the_same_field(tmp_path):
    sdf = random_grid(10)
    sdf.save(tmp_path / "lump.npz")
    again = GridSdf.load(tmp_path / "lump.npz")
    np.testing.assert_array_equal(again.values, sdf.values)
    np.testing.assert_array_equal(again.lower, sdf.lower)
    np.testing.assert_array_equal(again.upper, sdf.upper)


def test_file_that_is_no_field_is_named_in_the_error(tmp_path):
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04 and then nothing")
    with pytest.raises(VtgtsamError, match=r"cut\.npz is not a distance field"):
        GridSdf.load(tmp_path / "cut.npz")
    np.savez(tmp_path / "other.npz", values=np.zeros((3, 3, 3)))
    with pytest.raises(VtgtsamError, match="lower"):
        GridSdf.load(tmp_path / "other.npz")
    with pytest.raises(FileNotFoundError):
        GridSdf.load(tmp_path / "missing.npz")
    with pytest.raises(ValueError, match=r"\.npz"):
        random_grid(11).save(tmp_path / "field.txt")


@pytest.mark.parametrize(
    ("values", "lower", "upper", "message"),
    [
        (np.zeros((3, 3)), [0, 0, 0], [1, 1, 1], r"\(3, 3\)"),
        (np.zeros((3, 1, 3)), [0, 0, 0], [1, 1, 1], r"\(3, 1, 3\)"),
        (np.zeros((2, 2, 2)), [0, 0], [1, 1, 1], r"\(2,\)"),
        (np.zeros((2, 2, 2)), [0, 0, 0], [1, 0, 1], "below"),
        (np.zeros((2, 2, 2)), [0, 0, 0], [1, np.inf, 1], "finite"),
        (np.full((2, 2, 2), np.nan), [0, 0, 0], [1, 1, 1], "8 of 8"),
    ],
)
def test_grid_that_makes_no_sense_is_refused(values, lower, upper, message):
    with pytest.raises(ValueError, match=message):
        GridSdf(values, lower, upper)


@pytest.mark.parametrize("points", [np.zeros(3), np.zeros((2, 2)), np.zeros((1, 2, 3))])
def test_points_of_another_shape_are_refused(points):
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        random_grid(12).value(points)


def test_field_cannot_be_changed_from_outside():
    sdf = random_grid(13)
    with pytest.raises(ValueError, match="read-only"):
        sdf.values[0, 0, 0] = 1.0


def test_the_callers_array_stays_its_own():
    values = np.ones((4, 4, 4), np.float32)
    sdf = GridSdf(values, [0] * 3, [1] * 3)
    values[:] = 7.0
    assert sdf.value(np.full((1, 3), 0.5)) == 1.0 and not sdf.values.flags.writeable

# SPDX-License-Identifier: MIT
import copy
import gc
import pickle
import weakref
from dataclasses import replace

import gtsam
import numpy as np
import pytest
from problems import as_reference, ball_sdf, frame, lump_sdf, pads_around
from reference import exp_se3

from vtgtsam import (
    EstimatorConfig,
    Measurement,
    ObjectModel,
    Pad,
    PadSet,
    PoseEstimator,
    conclusion,
    load_hand,
)
from vtgtsam.covariance import covariance_of
from vtgtsam.factors.hand import place_hand, terms_at
from vtgtsam.factors.visual import place_visual
from vtgtsam.frame import _faults, _whiten, check
from vtgtsam.objective import Objective, cost, linearize
from vtgtsam.sdf.closest import ClosestPoints
from vtgtsam.sdf.pad_pose import points_in_world
from vtgtsam.sdf.search import closest_on_pads
from vtgtsam.solvers import steps

CONFIGS = [
    EstimatorConfig.simulation(),
    EstimatorConfig.real_world(),
    EstimatorConfig.tuned(recover=False),
    EstimatorConfig.tuned(recover=False, log_theta_vis=-2.0, w_pen=100.0),
]


def estimator_at(start, pads, obj, config):
    estimator = PoseEstimator(pads, obj, config)
    estimator.reset(gtsam.Pose3(start))
    return estimator


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("seed", range(5))
def test_five_fixed_damping_steps_are_the_independent_implementations(seed, config):
    config = config.model_copy(update={"solver": "fixed-damping"})
    pads, obj, measurement, start = frame(seed)
    estimate = estimator_at(start, pads, obj, config).update(measurement)
    problem = as_reference(pads, obj, measurement, config)
    expected = problem.fixed_damping(start, config.iterations, config.damping)
    np.testing.assert_allclose(estimate.T_wo.matrix(), expected, atol=1e-6)
    assert estimate.error == pytest.approx(problem.cost(expected), rel=1e-6)


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("seed", range(5))
def test_the_cost_and_its_linearization_are_the_independent_implementations(seed, config):
    pads, obj, measurement, start = frame(seed)
    objective = Objective(pads, obj, config)
    objective.place(check(measurement, pads))
    problem = as_reference(pads, obj, measurement, config)
    assert cost(start, *objective.tables) == pytest.approx(problem.cost(start), rel=1e-9)
    H, b = np.empty((6, 6)), np.empty(6)
    linearize(start, *objective.tables, H, b)
    expected_H, expected_b = problem.normal_equations(start)
    np.testing.assert_allclose(H, expected_H, atol=1e-8 * np.abs(expected_H).max())
    np.testing.assert_allclose(b, expected_b, atol=1e-8 * np.abs(expected_b).max())


@pytest.mark.parametrize("config", CONFIGS)
def test_lm_never_ends_at_a_higher_cost_than_it_began(config):
    for seed in range(30):
        pads, obj, measurement, start = frame(seed)
        estimate = estimator_at(start, pads, obj, config).update(measurement)
        problem = as_reference(pads, obj, measurement, config)
        end = problem.cost(estimate.T_wo.matrix())
        assert end <= problem.cost(start) * (1 + 1e-12)
        assert estimate.error == pytest.approx(end, rel=1e-9)


def test_contacts_improve_on_a_wrong_visual_pose():
    """A lump touched from all sides, at the world's origin; vision is 3 mm and 3 degrees off."""
    pads, T_wp = pads_around(1, count=14)
    obj = ObjectModel("lump", lump_sdf(1, 64))
    closest = ClosestPoints(pads, obj.sdf)
    closest.place(T_wp)
    gaps = closest.at(gtsam.Pose3()).distances
    T_wp[:, :3, 3] += gaps[:, None] * T_wp[:, :3, 2]  # pads now touch, along their own normals
    seen = gtsam.Pose3(exp_se3(np.array([0.03, -0.03, 0.03, 0.002, -0.002, 0.001])))
    config = EstimatorConfig.tuned(w_tac=1e7, w_pen=1e7)  # pads known to 0.3 mm
    estimator = PoseEstimator(pads, obj, config)
    for _ in range(10):
        estimate = estimator.update(
            Measurement(0.0, np.ones(14, bool), T_wp=T_wp, T_wo_visual=seen)
        )
    assert estimate.status == "ok"
    assert np.linalg.norm(estimate.T_wo.translation()) < 0.5 * np.linalg.norm(seen.translation())


def test_the_first_frame_starts_at_vision_and_later_ones_at_the_last_estimate():
    pads, obj, measurement, _ = frame(2)
    config = EstimatorConfig.simulation(solver="fixed-damping")
    estimator = PoseEstimator(pads, obj, config)
    problem = as_reference(pads, obj, measurement, config)
    first = estimator.update(measurement)
    expected = problem.fixed_damping(measurement.T_wo_visual.matrix(), 5, 0.02)
    np.testing.assert_allclose(first.T_wo.matrix(), expected, atol=1e-6)
    second = estimator.update(measurement)
    expected = problem.fixed_damping(first.T_wo.matrix(), 5, 0.02)
    np.testing.assert_allclose(second.T_wo.matrix(), expected, atol=1e-6)
    estimator.reset()
    np.testing.assert_array_equal(estimator.update(measurement).T_wo.matrix(), first.T_wo.matrix())


def test_it_waits_for_a_first_visual_pose():
    pads, obj, measurement, start = frame(3)
    estimator = PoseEstimator(pads, obj)
    unseen = replace(measurement, T_wo_visual=None)
    estimate = estimator.update(unseen)
    assert estimate.status == "waiting" and estimate.T_wo is None
    assert estimator.update(measurement).status == "ok"
    assert estimator.update(unseen).T_wo is not None


def test_without_vision_and_contact_it_says_that_nothing_is_measured():
    pads, obj, measurement, start = frame(4)
    far = measurement.T_wp.copy()
    far[:, :3, 3] += 1.0
    estimator = estimator_at(start, pads, obj, EstimatorConfig.tuned())
    nothing = replace(measurement, T_wo_visual=None, T_wp=far, contacts=np.zeros(8, bool))
    estimate = estimator.update(nothing)
    assert estimate.status == "unobservable"
    assert np.isposinf(np.diag(estimate.covariance)).all()
    np.testing.assert_allclose(estimate.T_wo.matrix(), start, atol=1e-9)


def test_a_visual_pose_too_far_away_is_lost_and_the_pose_stays():
    pads, obj, measurement, start = frame(5)
    far = start @ exp_se3(np.array([0, 0, 1.0, 0.3, 0, 0]))
    config = EstimatorConfig.simulation()
    estimator = estimator_at(start, pads, obj, config)
    jump = replace(measurement, T_wo_visual=gtsam.Pose3(far), contacts=np.zeros(8, bool))
    for _ in range(50):
        estimate = estimator.update(jump)
    assert estimate.status == "lost" and estimate.visual_weight < 1e-3
    assert np.linalg.norm(estimate.T_wo.translation() - start[:3, 3]) < 0.02


def test_a_lost_estimate_starts_again_from_vision_where_it_is_told_to():
    pads, obj, measurement, start = frame(5)
    far = start @ exp_se3(np.array([0, 0, 1.0, 0.3, 0, 0]))
    jump = replace(measurement, T_wo_visual=gtsam.Pose3(far), contacts=np.zeros(8, bool))
    estimate = estimator_at(start, pads, obj, EstimatorConfig.tuned()).update(jump)
    assert estimate.status == "ok"
    np.testing.assert_allclose(estimate.T_wo.translation(), far[:3, 3], atol=0.01)


@pytest.mark.parametrize(
    "broken",
    [
        {"T_wo_visual": gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))},
        {"T_wo_visual": gtsam.Pose3(2.0 * np.eye(4))},
        {"T_wp": np.full((8, 4, 4), np.nan)},
        {"visual_sigma": (0.0, 0.001)},
        {"visual_sigma": (0.01, np.inf)},
        {"visual_covariance": np.diag([1.0, 1, 1, 1, 1, -1])},
        {"visual_covariance": np.full((6, 6), np.nan)},
        {"time": np.nan},
    ],
)
def test_values_that_are_not_finite_are_not_used(broken):
    pads, obj, measurement, start = frame(6)
    estimator = estimator_at(start, pads, obj, EstimatorConfig.tuned())
    before = estimator.update(measurement)
    estimate = estimator.update(replace(measurement, **broken))
    assert estimate.status == "invalid"
    np.testing.assert_array_equal(estimate.T_wo.matrix(), before.T_wo.matrix())
    assert estimator.update(measurement).status == "ok"


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        ({"contacts": np.zeros(7, bool)}, r"shape \(8,\), one bit a pad, got \(7,\)"),
        ({"contacts": {"pad_0": True}}, "missing: pad_1, pad_2"),
        ({"contacts": np.full(8, 0.4)}, "must be bits"),
        ({"T_wp": np.zeros((7, 4, 4))}, r"T_wp must have shape \(8, 4, 4\)"),
        ({"T_wp": np.zeros((8, 4, 4))}, "must hold poses"),
        ({"T_wp": None}, "PadSet has no kinematics"),
        ({"visual_covariance": np.eye(3)}, r"visual_covariance must have shape \(6, 6\)"),
        ({"visual_sigma": (0.1, 0.1, 0.01)}, r"visual_sigma must have shape \(2,\), got .*3"),
        ({"visual_sigma": (0.1,) * 6}, r"visual_sigma must have shape \(2,\)"),
        ({"visual_sigma": 0.1}, r"visual_sigma must have shape \(2,\)"),
        ({"visual_sigma": "wide"}, "visual_sigma must be numbers"),
        ({"T_wp": [gtsam.Pose3()] * 8}, "T_wp must be numbers"),
        (
            {"T_wo_visual": np.eye(4)},
            r"T_wo_visual must be a gtsam.Pose3, got an array of shape \(4, 4\)",
        ),
        ({"T_wh": None}, "T_wh must be a gtsam.Pose3, got a NoneType"),
    ],
)
def test_a_malformed_measurement_raises_one_sentence(broken, message):
    pads, obj, measurement, _ = frame(7)
    with pytest.raises(ValueError, match=message):
        PoseEstimator(pads, obj, EstimatorConfig.tuned()).update(replace(measurement, **broken))


def test_it_starts_again_only_at_a_pose():
    pads, obj, _, _ = frame(7)
    with pytest.raises(
        ValueError, match=r"T_wo must be a gtsam.Pose3, .* gtsam.Pose3.matrix. makes"
    ):
        PoseEstimator(pads, obj, EstimatorConfig.tuned()).reset(np.eye(4))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_it_does_not_start_again_at_a_pose_that_is_not_finite(value):
    pads, obj, _, _ = frame(7)
    broken = gtsam.Pose3(gtsam.Rot3(), np.array([value, 0, 0]))
    with pytest.raises(ValueError, match="T_wo must be finite"):
        PoseEstimator(pads, obj, EstimatorConfig.tuned()).reset(broken)


def test_contacts_by_name_are_the_contacts_in_order():
    pads, obj, measurement, _ = frame(8)
    named = dict(zip(pads.pad_names, measurement.contacts.tolist(), strict=True))
    by_name = PoseEstimator(pads, obj).update(replace(measurement, contacts=named))
    in_order = PoseEstimator(pads, obj).update(measurement)
    np.testing.assert_array_equal(by_name.T_wo.matrix(), in_order.T_wo.matrix())


def test_what_a_frame_reports_about_its_pads():
    pads, obj, measurement, start = frame(9)
    config = EstimatorConfig.tuned(log_theta_tac=-9.0)
    estimate = estimator_at(start, pads, obj, config).update(measurement)
    problem = as_reference(pads, obj, measurement, config)
    T_wo = estimate.T_wo.matrix()
    phi, _, points_o = problem.closest(T_wo)
    np.testing.assert_allclose(estimate.pad_distances, phi, atol=1e-9)
    points_w = points_o @ T_wo[:3, :3].T + T_wo[:3, 3]
    np.testing.assert_allclose(estimate.contact_points_w, points_w, atol=1e-9)
    touching = np.asarray(measurement.contacts)
    expected = np.exp(-config.w_tac * np.maximum(phi, 0) ** 2 / np.exp(-9.0)) * touching
    np.testing.assert_allclose(estimate.pad_weights, expected, atol=1e-9)


def test_the_covariance_is_the_inverse_of_the_information():
    pads, obj, measurement, start = frame(10)
    config = EstimatorConfig.tuned()
    estimate = estimator_at(start, pads, obj, config).update(measurement)
    problem = as_reference(pads, obj, measurement, config)
    H, _ = problem.normal_equations(estimate.T_wo.matrix())
    np.testing.assert_allclose(estimate.covariance @ H, np.eye(6), atol=1e-5)


def test_a_visual_sigma_replaces_the_visual_weight():
    pads, obj, measurement, start = frame(11)
    own = EstimatorConfig.simulation(w_vis=(1 / 0.2**2, 1 / 0.05**2))
    by_config = estimator_at(start, pads, obj, own).update(measurement)
    by_frame = estimator_at(start, pads, obj, EstimatorConfig.simulation()).update(
        replace(measurement, visual_sigma=(0.2, 0.05))
    )
    np.testing.assert_allclose(by_frame.T_wo.matrix(), by_config.T_wo.matrix(), atol=1e-12)


def test_a_visual_covariance_counts_where_the_configuration_says_so():
    pads, obj, measurement, start = frame(12)
    covariance = np.diag([0.04] * 3 + [0.0025] * 3)
    told = replace(measurement, visual_covariance=covariance)
    by_sigma = estimator_at(start, pads, obj, EstimatorConfig.simulation()).update(
        replace(measurement, visual_sigma=(0.2, 0.05))
    )
    used = EstimatorConfig.simulation(use_visual_covariance=True)
    by_covariance = estimator_at(start, pads, obj, used).update(told)
    np.testing.assert_allclose(by_covariance.T_wo.matrix(), by_sigma.T_wo.matrix(), atol=1e-12)
    assert by_covariance.visual_weight == pytest.approx(by_sigma.visual_weight)
    plain = estimator_at(start, pads, obj, EstimatorConfig.simulation())
    before = plain.update(measurement)
    plain.reset(gtsam.Pose3(start))
    np.testing.assert_array_equal(plain.update(told).T_wo.matrix(), before.T_wo.matrix())


def test_a_direction_that_vision_does_not_see_is_left_to_touch():
    pads, obj, measurement, start = frame(12)
    config = EstimatorConfig.tuned(use_visual_covariance=True)
    shifted = gtsam.Pose3(start).retract(np.array([0, 0, 0, 0, 0, 0.01]))
    moved = []
    for sigma in (1e-4, 1.0):  # [m], along the shift
        measurement = replace(
            measurement,
            T_wo_visual=shifted,
            visual_covariance=np.diag([1e-4] * 3 + [1e-8, 1e-8, sigma**2]),
        )
        estimate = estimator_at(start, pads, obj, config).update(measurement)
        moved.append(gtsam.Pose3(start).localCoordinates(estimate.T_wo)[5])
    assert moved[0] > 0.009
    assert abs(moved[1]) < 0.005


def test_a_free_direction_has_infinite_variance_and_the_others_do_not():
    direction = np.array([0, 0, 0, 0.6, 0.8, 0])
    information = np.diag([4.0, 4, 4, 100, 100, 100])
    blind = np.eye(6) - np.outer(direction, direction)
    covariance = covariance_of(blind @ information @ blind)
    np.testing.assert_allclose(covariance[:3, :3], np.eye(3) / 4)
    assert covariance[5, 5] == pytest.approx(0.01)
    assert np.isposinf(covariance[3:5, 3:5]).all()
    assert not np.isnan(covariance).any()


def test_a_ball_can_spin_unseen_but_its_position_is_known():
    pads, T_wp = pads_around(12, count=12)
    obj = ObjectModel("ball", ball_sdf(resolution=96))
    estimator = PoseEstimator(pads, obj, EstimatorConfig.tuned())
    estimator.reset(gtsam.Pose3())
    estimate = estimator.update(Measurement(0.0, np.ones(12, bool), T_wp=T_wp))
    assert estimate.status == "unobservable"


def test_method_vis_is_the_visual_pose_and_holds_the_last_one():
    pads, obj, measurement, _ = frame(13)
    estimator = PoseEstimator(pads, obj, EstimatorConfig.tuned(method="vis"))
    seen = estimator.update(measurement)
    assert seen.T_wo.equals(measurement.T_wo_visual, 0.0) and seen.status == "ok"
    unseen = estimator.update(replace(measurement, T_wo_visual=None))
    assert unseen.T_wo.equals(measurement.T_wo_visual, 0.0) and unseen.status == "unobservable"


def test_method_vis_pen_does_not_feel_contacts():
    pads, obj, measurement, start = frame(14)
    config = EstimatorConfig.tuned(method="vis+pen")
    poses = [
        estimator_at(start, pads, obj, config).update(replace(measurement, contacts=bits)).T_wo
        for bits in (np.zeros(8, bool), np.ones(8, bool))
    ]
    np.testing.assert_array_equal(poses[0].matrix(), poses[1].matrix())


@pytest.mark.parametrize("engine", ["compiled", "gtsam"])
def test_nothing_holds_an_estimator_alive(engine):
    """A factor that kept its estimator in a cycle would leak a grid each time."""
    pads, obj, measurement, _ = frame(15)
    gc.collect()
    gc.disable()
    try:
        estimator = PoseEstimator(pads, obj, EstimatorConfig.tuned(engine=engine))
        estimator.update(measurement)
        objective = estimator._objective
        held = len(gc.get_referrers(objective))
        for _ in range(20):
            estimator.update(measurement)
        assert len(gc.get_referrers(objective)) == held
        weak = weakref.ref(objective)
        del objective, estimator
        assert weak() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("engine", ["compiled", "gtsam"])
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_copy_goes_on_where_the_estimator_was_and_by_itself(copied, engine):
    pads, obj, measurement, start = frame(17)
    config = EstimatorConfig.tuned(engine=engine)
    estimator = estimator_at(start, pads, obj, config)
    estimator.update(measurement)
    other = copied(estimator)
    expected = estimator.update(measurement)
    del estimator
    gc.collect()
    found = other.update(measurement)
    np.testing.assert_array_equal(found.T_wo.matrix(), expected.T_wo.matrix())


@pytest.mark.parametrize("engine", ["compiled", "gtsam"])
@pytest.mark.parametrize("size", [1e3, 1e20, 1e100])
def test_a_frame_of_nonsense_leaves_nothing_behind(size, engine):
    pads, obj, measurement, start = frame(18)
    config = EstimatorConfig.tuned(engine=engine)
    nonsense = measurement.T_wp.copy()
    nonsense[:, :3, 3] += size
    far = gtsam.Pose3(gtsam.Rot3(), np.full(3, size))
    estimator = estimator_at(start, pads, obj, config)
    expected = estimator.update(measurement).T_wo.matrix()
    for broken in ({"T_wp": nonsense}, {"T_wo_visual": far}):
        estimator.update(replace(measurement, **broken))
        estimator.reset(gtsam.Pose3(start))
        np.testing.assert_array_equal(estimator.update(measurement).T_wo.matrix(), expected)


def test_one_pad_is_enough_to_run():
    pads = PadSet([Pad("only", (0.01, 0.01))])
    obj = ObjectModel("ball", ball_sdf())
    estimate = PoseEstimator(pads, obj).update(
        Measurement(0.0, [True], T_wp=np.eye(4)[None], T_wo_visual=gtsam.Pose3())
    )
    assert estimate.T_wo is not None


def test_a_hand_with_kinematics_is_the_same_hand_with_given_pad_poses():
    hand = load_hand("isyhand")
    joints = dict.fromkeys(hand.joint_names, 0.4)
    T_wh = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, -0.3, 0.2), np.array([0.3, 0.1, 0.5]))
    seen = T_wh.compose(gtsam.Pose3(gtsam.Rot3(), np.array([0.1, 0.05, 0.07])))
    obj = ObjectModel("ball", ball_sdf())
    common = {"time": 0.0, "contacts": np.ones(len(hand), bool), "T_wo_visual": seen}
    by_joints = PoseEstimator(hand, obj).update(Measurement(joints=joints, T_wh=T_wh, **common))
    T_wp = hand.pad_transforms(joints, T_wh)
    by_poses = PoseEstimator(PadSet(hand.pads), obj).update(Measurement(T_wp=T_wp, **common))
    np.testing.assert_array_equal(by_joints.T_wo.matrix(), by_poses.T_wo.matrix())
    broken = PoseEstimator(hand, obj).update(
        Measurement(joints=joints | {hand.joint_names[3]: np.nan}, T_wh=T_wh, **common)
    )
    assert broken.status == "invalid"


@pytest.mark.parametrize("engine", ["compiled", "gtsam"])
@pytest.mark.parametrize("solver", ["lm", "fixed-damping"])
@pytest.mark.parametrize("method", ["vis", "vis+pen", "vis+tac+pen"])
def test_nothing_is_compiled_after_construction(method, solver, engine):
    pads, obj, measurement, _ = frame(16)
    functions = [closest_on_pads, points_in_world, covariance_of, terms_at, cost, linearize]
    functions += [steps.levenberg_marquardt, steps.fixed_damping, _faults, _whiten]
    functions += [conclusion._conclude, place_hand, place_visual]
    config = EstimatorConfig.tuned(method=method, solver=solver, engine=engine)
    estimator = PoseEstimator(pads, obj, config)
    compiled = [len(function.signatures) for function in functions]
    T_wp = np.asfortranarray(measurement.T_wp)
    T_wp.flags.writeable = False
    nothing, covariance = np.zeros(8, bool), np.asfortranarray(np.diag([1.0, 2, 3, 4, 5, 6]))
    far = gtsam.Pose3(gtsam.Rot3(), np.full(3, 9.0))
    estimator.update(replace(measurement, T_wo_visual=None))  # waiting
    estimator.update(replace(measurement, T_wp=T_wp))
    bits = np.repeat(measurement.contacts, 2)[::2]
    bits.flags.writeable = False
    estimator.update(replace(measurement, contacts=bits))
    estimator.update(replace(measurement, visual_covariance=covariance))
    estimator.update(replace(measurement, visual_sigma=(0.1, 0.01)))
    estimator.update(replace(measurement, time=np.nan))  # invalid
    estimator.update(replace(measurement, T_wo_visual=None, contacts=nothing))
    estimator.update(
        replace(measurement, T_wo_visual=far, contacts=nothing)
    )  # lost, and found again
    assert [len(function.signatures) for function in functions] == compiled

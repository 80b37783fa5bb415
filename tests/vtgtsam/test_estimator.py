# SPDX-License-Identifier: MIT
import copy
import gc
import math
import pickle
import weakref
from collections import Counter
from dataclasses import replace

import gtsam
import numpy as np
import pytest
from problems import alone, as_reference, ball_sdf, frame, lump_sdf, pads_around
from reference import exp_se3

from vtgtsam import (
    EstimatorConfig,
    Measurement,
    ObjectModel,
    Pad,
    PadSet,
    PoseEstimator,
    load_hand,
)
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.sdf.search.compiled_search import closest_on_pads
from vtgtsam.sdf.search.pad_pose import place_points

CONFIGS = [
    EstimatorConfig.simulation(),
    EstimatorConfig.real_world(),
    alone(recover=False),
    alone(recover=False, log_theta_vis=-2.0, w_pen=100.0),
]

CONSTRUCTORS = [
    "NonlinearFactorGraph",
    "PriorFactorPose3",
    "CustomFactor",
    "LevenbergMarquardtOptimizer",
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
    every = np.ones(14, dtype=bool)
    gaps = ClosestPoints(pads, obj.sdf).search(np.eye(4), T_wp, every).distances
    T_wp[:, :3, 3] += gaps[:, None] * T_wp[:, :3, 2]  # pads now touch, along their own normals
    seen = gtsam.Pose3(exp_se3(np.array([0.03, -0.03, 0.03, 0.002, -0.002, 0.001])))
    config = alone(w_tac=1e7, w_pen=1e7)  # pads known to 0.3 mm
    estimator = PoseEstimator(pads, obj, config)
    for _ in range(10):
        estimate = estimator.update(
            Measurement(0.0, np.ones(14, bool), T_wp=T_wp, T_wo_visual=seen)
        )
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
    estimator = estimator_at(start, pads, obj, alone())
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
    estimate = estimator_at(start, pads, obj, alone()).update(jump)
    assert estimate.status == "ok"
    np.testing.assert_allclose(estimate.T_wo.translation(), far[:3, 3], atol=0.01)


@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        (
            {"T_wo_visual": gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))},
            "vision not finite",
        ),
        ({"T_wo_visual": gtsam.Pose3(2.0 * np.eye(4))}, "vision not finite"),
        ({"T_wp": np.full((8, 4, 4), np.nan)}, "pad poses not finite"),
        ({"visual_sigma": (0.0, 0.001)}, "vision's covariance unusable"),
        ({"visual_sigma": (0.01, np.inf)}, "vision's covariance unusable"),
        ({"visual_covariance": np.diag([1.0, 1, 1, 1, 1, -1])}, "vision's covariance unusable"),
        ({"visual_covariance": np.full((6, 6), np.nan)}, "vision's covariance unusable"),
    ],
)
def test_what_is_not_finite_is_named_and_the_rest_is_used(broken, fault):
    pads, obj, measurement, start = frame(6)
    estimator = estimator_at(start, pads, obj, alone())
    estimator.update(measurement)
    estimate = estimator.update(replace(measurement, **broken))
    assert estimate.faults == (fault,) and estimate.status in ("ok", "unobservable")
    assert np.isfinite(estimate.T_wo.matrix()).all()
    assert estimate.visual_weight > 0.01 or "vision not" in fault
    assert estimate.pad_weights.max() > 0.01 or "pad poses" in fault
    assert estimator.update(measurement).faults == ()


def test_an_instant_that_is_not_finite_is_not_used():
    pads, obj, measurement, start = frame(6)
    estimator = estimator_at(start, pads, obj, alone())
    before = estimator.update(measurement)
    estimate = estimator.update(replace(measurement, time=np.nan))
    assert estimate.status == "invalid"
    np.testing.assert_array_equal(estimate.T_wo.matrix(), before.T_wo.matrix())


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
        ({"time": "0"}, "time must be a number of seconds, got '0'"),
        ({"visual_sigma": "wide"}, "visual_sigma must be numbers"),
        ({"T_wp": [gtsam.Pose3()] * 8}, "T_wp must be numbers"),
        (
            {"T_wo_visual": np.eye(4)},
            r"T_wo_visual must be a gtsam.Pose3, got an array of shape \(4, 4\)",
        ),
        ({"T_wh": np.eye(4)}, r"T_wh must be a gtsam.Pose3, got an array of shape \(4, 4\)"),
        ({"T_wh": [1, 2]}, "T_wh must be a gtsam.Pose3, got a list"),
    ],
)
def test_a_malformed_measurement_raises_one_sentence(broken, message):
    pads, obj, measurement, _ = frame(7)
    with pytest.raises(ValueError, match=message):
        PoseEstimator(pads, obj, alone()).update(replace(measurement, **broken))


def test_it_starts_again_only_at_a_pose():
    pads, obj, _, _ = frame(7)
    with pytest.raises(
        ValueError, match=r"T_wo must be a gtsam.Pose3, .* gtsam.Pose3.matrix. makes"
    ):
        PoseEstimator(pads, obj, alone()).reset(np.eye(4))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_it_does_not_start_again_at_a_pose_that_is_not_finite(value):
    pads, obj, _, _ = frame(7)
    broken = gtsam.Pose3(gtsam.Rot3(), np.array([value, 0, 0]))
    with pytest.raises(ValueError, match="T_wo must be finite"):
        PoseEstimator(pads, obj, alone()).reset(broken)


def test_contacts_by_name_are_the_contacts_in_order():
    pads, obj, measurement, _ = frame(8)
    named = dict(zip(pads.pad_names, measurement.contacts.tolist(), strict=True))
    by_name = PoseEstimator(pads, obj).update(replace(measurement, contacts=named))
    in_order = PoseEstimator(pads, obj).update(measurement)
    np.testing.assert_array_equal(by_name.T_wo.matrix(), in_order.T_wo.matrix())


def test_what_a_frame_reports_about_its_pads():
    pads, obj, measurement, start = frame(9)
    config = alone(log_theta_tac=-9.0)
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
    config = alone()
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
    config = alone(use_visual_covariance=True)
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


def test_a_ball_can_spin_unseen_but_its_position_is_known():
    pads, T_wp = pads_around(12, count=12)
    obj = ObjectModel("ball", ball_sdf(resolution=96))
    estimator = PoseEstimator(pads, obj, alone())
    estimator.reset(gtsam.Pose3())
    estimate = estimator.update(Measurement(0.0, np.ones(12, bool), T_wp=T_wp))
    assert estimate.status == "unobservable"


def test_method_vis_is_the_visual_pose_and_in_a_silence_the_last_one_moves_with_the_hand():
    pads, obj, measurement, _ = frame(13)
    estimator = PoseEstimator(pads, obj, alone(method="vis"))
    moved = gtsam.Pose3(exp_se3(np.array([0.5, -0.3, 0.2, 0.1, 0.2, -0.1])))
    T_wh = gtsam.Pose3(gtsam.Rot3.Rx(0.4), np.array([0.1, 0.0, 0.2]))
    seen = estimator.update(replace(measurement, T_wh=T_wh))
    assert seen.T_wo.equals(measurement.T_wo_visual, 1e-12) and seen.status == "ok"
    unseen = estimator.update(
        replace(
            measurement,
            T_wo_visual=None,
            T_wh=moved.compose(T_wh),
            T_wp=moved.matrix() @ measurement.T_wp,
        )
    )
    assert unseen.status == "lost" and unseen.iterations == 0
    assert unseen.T_wo.equals(moved.compose(measurement.T_wo_visual), 1e-9)
    assert np.isposinf(np.diag(unseen.covariance)).all()


def test_method_vis_pen_does_not_feel_contacts():
    pads, obj, measurement, start = frame(14)
    config = alone(method="vis+pen")
    poses = [
        estimator_at(start, pads, obj, config).update(replace(measurement, contacts=bits)).T_wo
        for bits in (np.zeros(8, bool), np.ones(8, bool))
    ]
    np.testing.assert_array_equal(poses[0].matrix(), poses[1].matrix())


def test_nothing_holds_an_estimator_alive():
    """A factor that kept its estimator in a cycle would leak a grid each time."""
    pads, obj, measurement, _ = frame(15)
    gc.collect()
    gc.disable()
    try:
        estimator = PoseEstimator(pads, obj, alone())
        for _ in range(3):
            estimator.update(measurement)
        field = weakref.ref(obj.sdf)
        del estimator, obj
        assert field() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_copy_goes_on_where_the_estimator_was_and_by_itself(copied):
    pads, obj, measurement, start = frame(17)
    estimator = estimator_at(start, pads, obj, alone())
    estimator.update(measurement)
    other = copied(estimator)
    expected = estimator.update(measurement)
    del estimator
    gc.collect()
    found = other.update(measurement)
    np.testing.assert_array_equal(found.T_wo.matrix(), expected.T_wo.matrix())


@pytest.mark.parametrize("size", [1e3, 1e20, 1e100])
def test_a_frame_of_nonsense_leaves_nothing_behind(size):
    pads, obj, measurement, start = frame(18)
    nonsense = measurement.T_wp.copy()
    nonsense[:, :3, 3] += size
    far = gtsam.Pose3(gtsam.Rot3(), np.full(3, size))
    estimator = estimator_at(start, pads, obj, alone())
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
    by_joints = PoseEstimator(hand, obj, alone()).update(
        Measurement(joints=joints, T_wh=T_wh, **common)
    )
    T_wp = hand.pad_transforms(joints, T_wh)
    by_poses = PoseEstimator(PadSet(hand.pads), obj, alone()).update(
        Measurement(T_wp=T_wp, **common)
    )
    np.testing.assert_allclose(by_joints.T_wo.matrix(), by_poses.T_wo.matrix(), atol=1e-9)
    broken = PoseEstimator(hand, obj, alone()).update(
        Measurement(joints=joints | {hand.joint_names[3]: np.nan}, T_wh=T_wh, **common)
    )
    assert broken.faults == ("joints not finite",)
    np.testing.assert_allclose(broken.T_wo.matrix(), seen.matrix(), atol=1e-6)


@pytest.mark.parametrize("solver", ["lm", "fixed-damping"])
@pytest.mark.parametrize("method", ["vis", "vis+pen", "vis+tac+pen"])
def test_nothing_is_compiled_after_construction(method, solver):
    pads, obj, measurement, _ = frame(16)
    functions = [closest_on_pads, place_points]
    estimator = PoseEstimator(pads, obj, alone(method=method, solver=solver))
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


@pytest.fixture
def made(monkeypatch):
    """How often each of GTSAM's constructors is called."""
    counts = Counter()

    def counted(name):
        constructor = getattr(gtsam, name)

        def call(*arguments, **named):
            counts[name] += 1
            return constructor(*arguments, **named)

        return call

    for name in CONSTRUCTORS:
        monkeypatch.setattr(gtsam, name, counted(name))
    return counts


def test_each_frame_is_a_factor_graph_of_its_own_that_gtsams_optimiser_solves(made):
    pads, obj, measurement, start = frame(19)
    estimator = estimator_at(start, pads, obj, alone())
    made.clear()
    rng = np.random.default_rng(19)
    for k in range(10):
        seen = measurement.T_wo_visual.retract(rng.normal(0, 0.002, 6))
        estimator.update(replace(measurement, time=0.1 * k, T_wo_visual=seen))
    assert measurement.contacts.any()
    for name in ("NonlinearFactorGraph", "PriorFactorPose3", "LevenbergMarquardtOptimizer"):
        assert made[name] >= 10, name
    assert made["CustomFactor"] == 20  # a tactile and a penetration factor a frame


@pytest.mark.parametrize("method", ["vis+pen", "vis+tac+pen"])
def test_without_contact_there_is_no_tactile_factor(made, method):
    pads, obj, measurement, start = frame(20)
    estimator = estimator_at(start, pads, obj, EstimatorConfig(method=method))
    made.clear()
    estimator.update(replace(measurement, contacts=np.zeros(8, bool)))
    assert made["CustomFactor"] == 1 and made["PriorFactorPose3"] == 1


def silent_while_the_hand_turns(with_hand_pose):
    """Estimates of a lump that nothing touches, in a hand that turns by 60 degrees; only the first frame is seen."""
    pads, T_hp = pads_around(21, distance=0.1)
    estimator = PoseEstimator(pads, ObjectModel("lump", lump_sdf(21)), alone())
    T_ho = gtsam.Pose3(gtsam.Rot3.Rx(0.3), np.array([0.01, 0.02, 0.0]))
    estimates = []
    for k in range(11):
        turn = gtsam.Rot3.Ry(math.radians(6.0 * k))
        T_wh = gtsam.Pose3(turn, np.array([0.1, 0.2, 0.3]))
        T_wo = T_wh.compose(T_ho)
        measurement = Measurement(
            time=0.1 * k,
            contacts=np.zeros(8, bool),
            T_wp=T_wh.matrix() @ T_hp,
            T_wh=T_wh if with_hand_pose else None,
            T_wo_visual=T_wo if k == 0 else None,
        )
        estimates.append((estimator.update(measurement), T_wo))
    return estimates


@pytest.mark.parametrize("with_hand_pose", [True, False])
def test_the_last_pose_is_carried_along_by_a_hand_that_turns(with_hand_pose):
    first, *later = silent_while_the_hand_turns(with_hand_pose)
    assert first[0].status == "ok"
    for estimate, T_wo in later:
        assert estimate.status == "unobservable"
        np.testing.assert_allclose(estimate.T_wo.matrix(), T_wo.matrix(), atol=1e-9)


def test_a_frame_that_is_not_used_leaves_the_hand_where_it_was():
    pads, obj, measurement, _ = frame(22)
    estimator = PoseEstimator(pads, obj, alone())
    before = estimator.update(measurement)
    estimator.update(replace(measurement, time=math.nan, T_wp=measurement.T_wp + 0.0))
    moved = gtsam.Pose3(gtsam.Rot3.Rz(0.5), np.array([0.0, 0.1, 0.0]))
    after = estimator.update(
        replace(
            measurement,
            T_wp=moved.matrix() @ measurement.T_wp,
            T_wo_visual=moved.compose(measurement.T_wo_visual),
        )
    )
    still = estimator_at(before.T_wo.matrix(), pads, obj, alone()).update(measurement)
    np.testing.assert_allclose(after.T_wo.matrix(), moved.compose(still.T_wo).matrix(), atol=1e-7)


def test_a_hand_that_moves_as_a_whole_changes_nothing_about_the_object_in_it():
    pads, obj, measurement, _ = frame(23)
    T_wh = gtsam.Pose3(gtsam.Rot3.Rx(0.4), np.array([0.1, 0.0, 0.2]))
    G = gtsam.Pose3(gtsam.Rot3.RzRyRx(1.0, -0.5, 2.0), np.array([1.0, -2.0, 0.5]))
    here = PoseEstimator(pads, obj).update(replace(measurement, T_wh=T_wh))
    there = PoseEstimator(pads, obj).update(
        replace(
            measurement,
            T_wh=G.compose(T_wh),
            T_wp=G.matrix() @ measurement.T_wp,
            T_wo_visual=G.compose(measurement.T_wo_visual),
        )
    )
    np.testing.assert_allclose(there.T_wo.matrix(), G.compose(here.T_wo).matrix(), atol=1e-9)
    np.testing.assert_allclose(there.covariance, here.covariance, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(
        there.contact_points_w,
        here.contact_points_w @ G.rotation().matrix().T + G.translation(),
        atol=1e-9,
    )

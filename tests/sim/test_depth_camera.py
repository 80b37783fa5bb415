# SPDX-License-Identifier: MIT
import gtsam
import mujoco
import numpy as np
import pytest
import trimesh

from sim.camera import D435, DepthCamera, add_depth_noise, depth_sigma

SMALL = D435.scaled(0.1)
T_WC = gtsam.Pose3(gtsam.Rot3(np.diag([1.0, -1.0, -1.0])), np.array([0.0, 0.0, 1.0]))  # looks down
SCENE = """<mujoco>
  <asset><mesh name="wedge" vertex="{vertices}" face="{faces}"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="3 3 0.1" pos="0 0 -0.5"/>
    <geom name="box" type="box" size="0.1 0.05 0.2" pos="0.2 0 0.1"/>
    <geom name="wall far away" type="box" size="0.1 5 5" pos="-9 0 0"/>
    <geom name="contact only" type="sphere" size="0.3" group="3" pos="0 0 0.4"/>
    <body name="object" mocap="true">
      <geom name="object" type="mesh" mesh="wedge" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>"""


def l_shape():
    """A mesh that is not convex: two boxes that form an L."""
    lying = trimesh.creation.box((0.2, 0.1, 0.05))
    standing = trimesh.creation.box((0.05, 0.1, 0.2))
    standing.apply_translation((-0.075, 0.0, 0.075))
    return trimesh.util.concatenate([lying, standing])


def scene():
    mesh = l_shape()
    numbers = {
        "vertices": " ".join(f"{x:.9g}" for x in mesh.vertices.ravel()),
        "faces": " ".join(str(i) for i in mesh.faces.ravel()),
    }
    model = mujoco.MjModel.from_xml_string(SCENE.format(**numbers))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def pixel_of(camera, point_w):
    u, v = camera.project(T_WC.transformTo(np.array(point_w))[None])[0]
    return round(v), round(u)


@pytest.fixture(scope="module")
def image():
    model, data = scene()
    depth, geom = DepthCamera(model, SMALL).render(data, T_WC)
    return model, depth, geom


def test_depth_is_the_distance_along_the_optical_axis_not_along_the_ray(image):
    model, depth, geom = image
    floor = geom == model.geom("floor").id
    assert floor[0, 0] and floor[-1, 0]  # corners, where rays are longest
    np.testing.assert_allclose(depth[floor], 1.5, atol=1e-9)


def test_each_pixel_names_the_geom_it_sees(image):
    model, depth, geom = image
    v, u = pixel_of(SMALL, (0.2, 0.0, 0.3))
    assert geom[v, u] == model.geom("box").id
    assert depth[v, u] == pytest.approx(0.7, abs=1e-9)


def test_the_true_mesh_is_seen_and_not_its_hull(image):
    model, depth, geom = image
    v, u = pixel_of(SMALL, (0.05, 0.0, 0.025))  # on the lying part, which the hull covers
    assert geom[v, u] == model.geom("object").id
    assert depth[v, u] == pytest.approx(1.0 - 0.025, abs=1e-6)


def test_geometry_that_is_only_for_contacts_is_not_seen(image):
    model, _, geom = image
    assert not (geom == model.geom("contact only").id).any()


def test_what_is_out_of_range_is_not_measured():
    model, data = scene()
    sideways = gtsam.Pose3(gtsam.Rot3.Ry(-np.pi / 2), np.array([0.5, 0.0, 5.0]))
    depth, geom = DepthCamera(model, SMALL).render(data, sideways)
    assert (depth == 0.0).all()
    assert (geom == -1).all()


def test_a_window_of_the_image_is_the_same_as_the_image_there(image):
    model, data = scene()
    _, depth, _ = image
    window = SMALL.cropped(left=20, top=10, width=15, height=12)
    part, _ = DepthCamera(model, window).render(data, T_WC)
    np.testing.assert_allclose(part, depth[10:22, 20:35], atol=1e-12)


def test_the_camera_may_stand_anywhere():
    model, data = scene()
    tilted = T_WC * gtsam.Pose3(gtsam.Rot3.Rz(0.3) * gtsam.Rot3.Rx(0.2), np.array([0.1, 0.05, 0.0]))
    depth, geom = DepthCamera(model, SMALL).render(data, tilted)
    floor = geom == model.geom("floor").id
    points_w = np.array([tilted.transformFrom(p) for p in SMALL.back_project(depth)[floor.ravel()]])
    np.testing.assert_allclose(points_w[:, 2], -0.5, atol=1e-9)


def test_the_noise_has_the_paper_s_deviation_at_each_depth_and_no_bias():
    rng = np.random.default_rng(0)
    for distance in (0.4, 0.83, 1.5):
        depth = np.full((300, 300), distance)
        error = add_depth_noise(depth, rng) - depth
        expected = 0.001063 + 0.0007278 * distance + 0.003949 * distance**2
        # 90,000 samples: the standard deviation is good to 0.24 %, so 1 % is 4 sigma.
        assert error.std() == pytest.approx(expected, rel=0.01)
        assert abs(error.mean()) < 4 * expected / 300


def test_neighbouring_pixels_have_independent_noise():
    error = add_depth_noise(np.ones((300, 300)), np.random.default_rng(0)) - 1.0
    correlation = np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]
    assert abs(correlation) < 0.015  # 4 sigma of 90,000 samples


def test_the_scale_multiplies_the_noise_and_the_seed_repeats_it():
    depth = np.full((20, 20), 0.8)
    once = add_depth_noise(depth, np.random.default_rng(3)) - depth
    thrice = add_depth_noise(depth, np.random.default_rng(3), scale=3.0) - depth
    np.testing.assert_allclose(thrice, 3.0 * once, atol=1e-12)
    assert once.std() > 0.5 * depth_sigma(np.array(0.8))


def test_noise_leaves_pixels_without_depth_alone():
    depth = np.zeros((10, 10))
    depth[3, 4] = 0.01
    noisy = add_depth_noise(depth, np.random.default_rng(0), scale=50.0)
    assert np.count_nonzero(noisy) == 1
    assert noisy[3, 4] > 0.0

# SPDX-License-Identifier: MIT
"""Rays against MuJoCo's own, one by one."""

import mujoco
import numpy as np
import pytest
import trimesh

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.rays import RayCaster, RayGrid

CAMERA = CameraIntrinsics(60, 44, 50.0, 52.0, 28.3, 23.1)
GROUPS = (0, 1, 2)
SHOWN = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
SOLIDS = {
    "sphere": '<geom type="sphere" size="0.2" {}/>',
    "capsule": '<geom type="capsule" size="0.1 0.2" {}/>',
    "cylinder": '<geom type="cylinder" size="0.15 0.2" {}/>',
    "box": '<geom type="box" size="0.2 0.1 0.15" {}/>',
    "mesh": '<geom type="mesh" mesh="torus" {}/>',
}
PLACES = (
    'pos="0.1 -0.05 0.9" euler="30 50 -20"',  # in front of the camera
    'pos="0.3 0.2 0.8" euler="80 10 40"',  # cut by the image's edge
    'pos="0.02 0.05 0.06" euler="15 0 70"',  # with the camera in it, or in its middle
    'pos="0.14 0.06 0.1" euler="90 0 0"',  # beside the camera, a part of it behind
)


def posed(geoms, bodies=""):
    """A scene of geoms, at its poses."""
    torus = trimesh.creation.torus(0.15, 0.06, major_sections=20, minor_sections=12)
    vertices = " ".join(f"{x:.7g}" for x in torus.vertices.ravel())
    faces = " ".join(str(i) for i in torus.faces.ravel())
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <asset><mesh name="torus" vertex="{vertices}" face="{faces}"/></asset>
      <worldbody>{geoms}{bodies}</worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def image_rays(R_wc=None):
    R_wc = np.eye(3) if R_wc is None else R_wc
    return RayGrid.image(CAMERA, R_wc, CAMERA.rays().reshape(-1, 3) @ R_wc.T)


def one_by_one(model, data, origin_w, rays_w):
    """Geom, distance and normal of each ray by ``mj_ray``."""
    found = []
    for ray in rays_w:
        geom, normal = np.empty(1, dtype=np.int32), np.zeros(3)
        distance = mujoco.mj_ray(model, data, origin_w, ray, SHOWN, 1, -1, geom, normal)
        found.append((geom[0], distance, normal))
    return [np.array(column) for column in zip(*found, strict=True)]


def all_at_once(model, data, origin_w, rays_w):
    """The same by ``mj_multiRay``."""
    n = len(rays_w)
    geom, distance, normals = np.empty(n, dtype=np.int32), np.empty(n), np.zeros(3 * n)
    mujoco.mj_multiRay(
        *(model, data, origin_w, rays_w.ravel(), SHOWN, 1, -1),
        *(geom, distance, normals, n, mujoco.mjMAXVAL),
    )
    return geom, distance, normals.reshape(-1, 3)


def assert_same(met, expected):
    geom, distance, normals_w = expected
    np.testing.assert_array_equal(met.geom, geom)
    np.testing.assert_allclose(met.distance, distance, atol=1e-12)
    np.testing.assert_allclose(met.normals_w, normals_w, atol=1e-9)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("solid", SOLIDS)
def test_each_ray_meets_what_mujoco_says(solid, place):
    model, data = posed(SOLIDS[solid].format(place))
    origin_w = np.array([0.01, -0.02, 0.0])
    rays = image_rays()
    met = RayCaster(model, GROUPS).cast(data, origin_w, rays)
    assert (met.geom >= 0).sum() > 50
    assert_same(met, one_by_one(model, data, origin_w, rays.rays_w))


def test_of_several_geoms_the_nearest_is_met():
    solids = [text.format(f'pos="{0.1 * k} 0 {1 + 0.05 * k}"') for k, text in enumerate(SOLIDS.values())]  # fmt: skip
    model, data = posed("".join(solids))
    turned = trimesh.transformations.rotation_matrix(0.2, (1.0, 2.0, 0.5))[:3, :3]
    rays = image_rays(turned)
    met = RayCaster(model, GROUPS).cast(data, np.zeros(3), rays)
    assert set(np.unique(met.geom)) >= set(range(4))
    assert_same(met, one_by_one(model, data, np.zeros(3), rays.rays_w))


def test_rays_that_are_no_image_s_meet_the_same():
    model, data = posed("".join(text.format(PLACES[0]) for text in SOLIDS.values()))
    rng = np.random.default_rng(0)
    rays_w = np.column_stack([rng.uniform(-0.5, 0.5, (800, 2)), rng.uniform(0.5, 2.0, 800)])
    rays, order = RayGrid.sort(np.eye(3), rays_w, 40.0)
    np.testing.assert_array_equal(rays.rays_w, rays_w[order])
    met = RayCaster(model, GROUPS).cast(data, np.zeros(3), rays)
    assert (met.geom >= 0).sum() > 50
    assert_same(met, one_by_one(model, data, np.zeros(3), rays_w[order]))


def test_what_is_transparent_or_in_another_group_is_not_met():
    model, data = posed(
        SOLIDS["box"].format('pos="0 0 1" rgba="1 1 1 0"')
        + SOLIDS["sphere"].format('pos="0 0 1" group="3"')
        + SOLIDS["cylinder"].format('pos="0 0 1.5"')
    )
    rays = image_rays()
    met = RayCaster(model, GROUPS).cast(data, np.zeros(3), rays)
    assert set(np.unique(met.geom)) == {-1, 2}
    assert_same(met, one_by_one(model, data, np.zeros(3), rays.rays_w))


def test_a_scene_with_other_geoms_is_mujoco_s_own_work():
    model, data = posed(
        '<geom type="plane" size="1 1 1" pos="0 0 2" euler="150 10 0"/>'
        '<geom type="ellipsoid" size="0.1 0.2 0.3" pos="0 0 1"/>'
    )
    rays = image_rays()
    met = RayCaster(model, GROUPS).cast(data, np.zeros(3), rays)
    assert set(np.unique(met.geom)) == {-1, 0, 1}
    assert_same(met, all_at_once(model, data, np.zeros(3), rays.rays_w))

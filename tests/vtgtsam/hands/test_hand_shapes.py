# SPDX-License-Identifier: MIT
import mujoco
import numpy as np
import pytest
import trimesh

pytest.importorskip("rerun", reason="the viewer (extra viz) is not installed")

from vtgtsam import load_hand  # noqa: E402
from vtgtsam.hands.shapes import link_meshes  # noqa: E402

TETRA = "0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"
GEOMS = {
    "box": 'type="box" size="0.01 0.02 0.03"',
    "sphere": 'type="sphere" size="0.02"',
    "ellipsoid": 'type="ellipsoid" size="0.01 0.02 0.03"',
    "cylinder": 'type="cylinder" size="0.02 0.05"',
    "capsule": 'type="capsule" size="0.02 0.05"',
    "mesh": 'type="mesh" mesh="tetra"',
}


def model_of(geoms):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="tetra" vertex="{TETRA}"/></asset><worldbody><body name="link">'
        f"{geoms}</body></worldbody></mujoco>"
    )


@pytest.mark.parametrize("kind", GEOMS)
def test_each_geoms_triangles_lie_where_mujocos_rays_meet_it(kind):
    """MuJoCo's own ray casting is the reference."""
    place = 'pos="0.1 -0.2 0.3" euler="20 -40 70"'
    model = model_of(f"<geom {GEOMS[kind]} {place}/>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (mesh,) = link_meshes(model).values()
    middle = mesh.vertices.mean(axis=0) + data.xpos[1]
    shape = trimesh.Trimesh(mesh.vertices + data.xpos[1], mesh.faces)
    rng = np.random.default_rng(0)
    for direction in rng.normal(size=(40, 3)):
        start = middle + 0.5 * direction / np.linalg.norm(direction)
        hit = np.zeros(1, dtype=np.int32)
        distance = mujoco.mj_ray(model, data, start, middle - start, None, 1, -1, hit)
        assert hit[0] == 0
        met = start + distance * (middle - start)
        corners = shape.triangles
        closest = trimesh.triangles.closest_point(corners, np.tile(met, (len(corners), 1)))
        gap = np.linalg.norm(closest - met, axis=1).min()
        assert gap < 6e-4  # [m], facets of round shapes lie inside by 2 % of their radius


def test_what_only_collides_is_not_drawn_unless_there_is_nothing_else():
    visual, collision = (f"<geom {GEOMS['box']} {group}/>" for group in ("", 'group="3"'))
    (both,) = link_meshes(model_of(visual + collision)).values()
    (alone,) = link_meshes(model_of(collision)).values()
    assert len(both.faces) == len(alone.faces) == 12


def test_the_built_in_hand_has_a_shape_on_every_link_and_its_own_colors():
    model = load_hand("isyhand").model
    links = link_meshes(model)
    assert set(links) == {body for body in range(1, model.nbody) if model.body_geomnum[body]}
    palm = links[model.body("base").id]
    assert [round(255 * c) for c in (0.80, 0.81, 0.83, 1)] in palm.colors.tolist()

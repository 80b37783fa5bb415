# SPDX-License-Identifier: MIT
import mujoco
import numpy as np
import pytest
import trimesh

from sim import constants as c
from sim.hands import load_description
from sim.placement import above_palm
from sim.scene import CAMERA, HAND, OBJECT, WRIST, build, pad_geom, rounded_box
from sim.world import World
from vtgtsam import ObjectModel, build_sdf, load_hand, load_object
from vtgtsam.exceptions import MeshError


@pytest.fixture(scope="module")
def world():
    mesh = trimesh.creation.box((0.05, 0.06, 0.04))
    description = load_description()
    return World(
        description, description.load_hand(), ObjectModel("box", build_sdf(mesh, 16), mesh)
    )


def test_the_scene_has_the_hands_joints_a_servo_for_each_and_a_geom_for_each_pad(world):
    model, hand = world.model, world.hand
    joints = [model.joint(i).name for i in range(model.njnt)]
    assert joints == [WRIST, *(HAND + name for name in hand.joint_names), OBJECT]
    assert model.nu == len(hand.joint_names) + 1
    for name in hand.pad_names:
        assert model.geom(pad_geom(name)).contype == 0


def test_the_physics_is_the_papers(world):
    option = world.model.opt
    assert option.timestep == 0.001
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    servo = world.model.actuator(HAND + "index_middle")
    assert (servo.gainprm[0], servo.biasprm[1]) == (0.7, -0.7)
    assert world.model.geom("object part 0").friction.tolist() == [1.0, 0.005, 0.0001]  # default


def test_dry_friction_is_ten_times_as_stiff_and_nothing_else_differs(world):
    dry = World(world.description, world.hand, world.obj, "dry")
    assert (world.model.opt.impratio, dry.model.opt.impratio) == (1.0, 10.0)
    np.testing.assert_array_equal(dry.model.geom_friction, world.model.geom_friction)


def test_a_second_of_random_commands_gives_no_warning(world):
    rng = np.random.default_rng(0)
    world.place(above_palm(world.description, world.obj.mesh, np.eye(3)))
    for _ in range(20):
        world.command(rng.uniform(*world.limits.T), rng.uniform(0.0, c.TURN_ANGLE))
        for _ in range(50):
            world.step()
    assert sum(warning.number for warning in world.data.warning) == 0
    assert np.isfinite(world.data.qpos).all()


def test_the_camera_looks_at_the_palm_from_the_papers_place(world):
    world.place(np.eye(4))
    camera = world.data.cam(CAMERA)
    palm = world.T_wh()[:3, :3] @ world.description.palm.center
    np.testing.assert_allclose(camera.xpos - palm, (0.6, 0.0, 0.576), atol=1e-9)
    ray = -camera.xmat.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(np.cross(ray, palm - camera.xpos), 0.0, atol=1e-9)


def test_pads_in_the_scene_are_where_the_hand_model_says(world):
    rng = np.random.default_rng(1)
    world.data.qpos[:] = 0.0
    angles = rng.uniform(-0.2, 0.4, len(world.hand.joint_names))
    for name, angle in zip(world.hand.joint_names, angles, strict=True):
        world.data.joint(HAND + name).qpos = angle
    world.data.joint(WRIST).qpos = 0.3
    world.refresh()
    np.testing.assert_allclose(world.joints(), angles)
    T_wp = world.hand.pad_transforms(angles, world.T_wh())
    for name, T in zip(world.hand.pad_names, T_wp, strict=True):
        geom = world.model.geom(pad_geom(name))
        mesh = geom.dataid[0]
        begin, count = world.model.mesh_vertadr[mesh], world.model.mesh_vertnum[mesh]
        pose = world.data.geom(pad_geom(name))
        vertices = world.model.mesh_vert[begin : begin + count]
        vertices_w = vertices @ pose.xmat.reshape(3, 3).T + pose.xpos
        heights = (vertices_w - T[:3, 3]) @ T[:3, 2]
        assert heights.max() == pytest.approx(0.0, abs=1e-6)
        top = vertices_w[heights > -1e-6]
        np.testing.assert_allclose(top.mean(axis=0), T[:3, 3], atol=1e-6)


def test_the_flat_part_of_a_pad_ends_where_its_grid_does(world):
    for pad in world.hand.pads:
        corners = rounded_box(np.array([*pad.size, 0.003]))
        flat = corners[corners[:, 2] > -1e-9]
        reach = np.abs(pad.points_p).max(axis=0)[:2]
        assert (np.abs(flat[:, :2]).max(axis=0) - reach).max() <= 0.0005 + 1e-9  # half a spacing
        np.testing.assert_allclose(np.abs(corners[:, :2]).max(axis=0), pad.size / 2)


def test_the_object_has_the_mass_and_inertia_of_an_even_solid(world):
    mass = 0.05 * 0.06 * 0.04 * c.DENSITY
    body = world.model.body(OBJECT)
    assert body.mass[0] == pytest.approx(mass)
    expected = mass / 12 * np.array([0.06**2 + 0.04**2, 0.05**2 + 0.04**2, 0.05**2 + 0.06**2])
    np.testing.assert_allclose(np.sort(body.inertia), np.sort(expected))


def test_an_object_of_known_mass_keeps_it():
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    description = load_description()
    obj = ObjectModel("ball", build_sdf(mesh, 16), mesh, mass=0.123)
    heavy = World(description, description.load_hand(), obj)
    assert heavy.model.body(OBJECT).mass[0] == pytest.approx(0.123)


def test_a_pad_keeps_its_size_whatever_the_hands_file_has_as_defaults(tmp_path):
    text = load_hand("isyhand").xml
    mesh = '<mesh scale="0.001 0.001 0.001"/>'
    geom = '<geom margin="0.01" gap="0.005" priority="3" solref="0.5 1" condim="1"/>'
    path = tmp_path / "hand.xml"
    path.write_text(text.replace('<geom rgba="0.25 0.27 0.30 1"/>', mesh + geom, 1))
    assert geom in path.read_text()
    description = load_description("isyhand")
    plain = build(description, load_hand("isyhand"), load_object("can"))
    other = build(description, load_hand(path), load_object("can"))
    for name in load_hand("isyhand").pad_names:
        a, b = plain.geom(pad_geom(name)), other.geom(pad_geom(name))
        for what in ("margin", "gap", "priority", "solref", "condim", "size"):
            np.testing.assert_array_equal(getattr(a, what), getattr(b, what), err_msg=what)
        np.testing.assert_array_equal(plain.geom_aabb[a.id], other.geom_aabb[b.id])


def test_a_hand_of_collision_shapes_alone_is_seen(tmp_path):
    path = tmp_path / "hand.xml"
    text = load_hand("isyhand").xml
    path.write_text(text.replace("<geom ", '<geom group="3" '))
    hand = load_hand(path)
    model = build(load_description("isyhand"), hand, load_object("can"))
    links = [g for g in range(model.ngeom) if model.geom(g).name.startswith("hand/")]
    of_links = [
        g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name.startswith("hand/")
    ]
    assert len(of_links) > len(links) >= 16
    assert all(model.geom_group[g] < 3 for g in of_links)


def test_a_hands_own_options_give_no_warning(tmp_path, recwarn, capfd):
    path = tmp_path / "hand.xml"
    text = load_hand("isyhand").xml
    option = '<option cone="pyramidal" impratio="10" timestep="0.004"/>'
    path.write_text(text.replace("<worldbody>", f"{option}<worldbody>", 1))
    model = build(load_description("isyhand"), load_hand(path), load_object("can"))
    assert not recwarn.list and "conflict" not in capfd.readouterr().out
    assert model.opt.impratio == 1


def test_an_object_that_is_known_by_its_field_alone_is_refused_in_one_sentence():
    description = load_description("isyhand")
    alone = ObjectModel("cube", load_object("cube").sdf)
    with pytest.raises(MeshError, match="'cube' has a field alone, and this needs its mesh"):
        World(description, description.load_hand(), alone)

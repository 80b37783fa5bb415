# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest

from hardware.camera.camera import CameraError, CameraFrame
from hardware.camera.wrist import TagMount, load_wrist, measure_wrist, save_wrist
from hardware.emulate.tag_view import TagCamera
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import ConfigError

pytest.importorskip("pupil_apriltags", reason="pupil-apriltags is not installed")

INTRINSICS = CameraIntrinsics(640, 480, 615.0, 615.0, 319.5, 239.5)
# Flat on the wrist behind the palm, whose normal is z of the hand, upright for a camera behind it.
MOUNT = TagMount(id=0, size=0.04, T_ht=(-0.04, 0.01, 0.04, 0.7071068, -0.7071068, 0, 0))
# The paper's camera: 0.31 m behind and 0.32 m above the hand, looking at it.
DOWN = np.arctan2(0.32, 0.31)  # [rad], from the horizontal
T_CH = gtsam.Pose3(
    gtsam.Rot3(
        np.array(
            [
                [0.0, -1.0, 0.0],
                [-np.sin(DOWN), 0.0, -np.cos(DOWN)],
                [np.cos(DOWN), 0.0, -np.sin(DOWN)],  # fingers away from the camera
            ]
        )
    ),
    np.array([0.01, 0.02, 0.45]),
)


def angle_deg(a, b):
    return np.rad2deg(np.linalg.norm(gtsam.Rot3.Logmap(a.rotation().between(b.rotation()))))


def test_the_hand_is_found_from_the_tag_on_its_wrist():
    camera = TagCamera(T_CH.compose(MOUNT.pose), MOUNT.size, INTRINSICS)
    T_ch, tag, _ = measure_wrist(camera, MOUNT)
    assert angle_deg(T_ch, T_CH) < 0.3
    assert np.linalg.norm(T_ch.translation() - T_CH.translation()) < 0.001
    assert tag.images == 30 and tag.warning == ""


class Ends(TagCamera):
    """A recording of 12 images."""

    left = 12

    def read(self):
        self.left -= 1
        return super().read() if self.left >= 0 else None


class Blind(TagCamera):
    """A recording without colour."""

    left = 40

    def read(self):
        self.left -= 1
        return CameraFrame(0.0, np.zeros((480, 640)), None) if self.left >= 0 else None


@pytest.mark.parametrize("kind, count", [(Ends, 12), (Blind, 0)])
def test_too_few_images_are_refused(kind, count):
    camera = kind(T_CH.compose(MOUNT.pose), MOUNT.size, INTRINSICS)
    with pytest.raises(CameraError, match=f"ended after {count} colour images, 30 are needed"):
        measure_wrist(camera, MOUNT)


def test_the_calibration_survives_its_file(tmp_path):
    save_wrist(tmp_path / "wrist.yaml", T_CH)
    assert load_wrist(tmp_path / "wrist.yaml").equals(T_CH, 1e-6)  # 7 digits


@pytest.mark.parametrize(
    "text, message",
    [
        ("[", "the wrist calibration .* is not valid YAML"),
        ("", "must hold T_ch"),
        ("T_ch: [0, 0, 0.4, 0, 0, 0, 2]", "quaternion of norm 1, got .*: run `python -m hardware"),
        ("T_ch: [0, 0, .nan, 0, 0, 0, 1]", "must hold T_ch"),
    ],
)
def test_a_broken_file_is_refused_in_one_sentence(tmp_path, text, message):
    path = tmp_path / "wrist.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as error:
        load_wrist(path)
    assert "\n" not in str(error.value)


def test_a_size_in_millimetres_is_refused():
    with pytest.raises(ValueError, match="less than 0.5"):
        TagMount(id=0, size=40, T_ht=(0, 0, 0, 0, 0, 0, 1))

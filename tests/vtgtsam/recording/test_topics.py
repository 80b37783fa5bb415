# SPDX-License-Identifier: MIT
import pytest

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import load_topics

NEEDED = "topics: {joints: /j, contacts: /c%s}"


def load(tmp_path, text):
    (tmp_path / "map.yaml").write_text(text)
    return load_topics(tmp_path / "map.yaml")


def test_everything_but_joints_and_contacts_has_a_default(tmp_path):
    topic_map = load(tmp_path, NEEDED % "")
    assert (topic_map.hand, topic_map.object, topic_map.pads) == (None, None, "pad_*")
    topics = topic_map.topics
    assert (topics.joints, topics.contacts.topic) == ("/j", "/c")
    assert (topics.vision.topic, topics.vision.latency, topics.vision.frame) == (
        "/vision/object_pose",
        0.0,
        "world",
    )
    assert topics.truth == "/truth/object_pose"


def test_files_are_found_relative_to_the_map_and_names_stay_names(tmp_path):
    (tmp_path / "my.xml").write_text("")
    (tmp_path / "my.obj").write_text("")
    topic_map = load(
        tmp_path,
        f"hand: my.xml\nobject: {{mesh: my.obj, scale: 0.001, origin: center}}\n{NEEDED % ''}",
    )
    assert topic_map.hand == str(tmp_path / "my.xml")
    assert topic_map.object.mesh == str(tmp_path / "my.obj")
    named = load(tmp_path, f"hand: isyhand\nobject: can\n{NEEDED % ''}")
    assert (named.hand, named.object) == ("isyhand", "can")


def test_a_fixed_camera_pose_is_seven_numbers(tmp_path):
    topics = load(tmp_path, NEEDED % ", camera_pose: [0.6, 0, 0.5, 0, 0, 1, 0]").topics
    T_wc = topics.fixed_camera_pose()
    assert T_wc.translation().tolist() == [0.6, 0, 0.5]
    assert T_wc.rotation().matrix()[0, 0] == pytest.approx(-1)
    assert "/camera/pose" not in set(topics.used())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must have an entry 'topics'"),
        ("- a\n- b", "must have an entry 'topics'"),
        ("topics: [", "is not valid YAML"),
        ("topics: {joints: /j}", "the entry 'topics.contacts' is missing"),
        (NEEDED % "" + "\nhands: x", "unknown entry 'hands'; remove it or correct its name"),
        (NEEDED % ", visoin: /v", "unknown entry 'topics.visoin'"),
        (
            NEEDED % ", vision: {topic: /v, frame: cam}",
            "'topics.vision.frame': input should be 'world' or 'camera', got 'cam'",
        ),
        (NEEDED % ", vision: {latency: soon}", "'topics.vision.latency': .*valid number"),
        (NEEDED % ", vision: {latency: .nan}", "'topics.vision.latency': .*finite"),
        (NEEDED % ", camera_pose: [0, 0, 0]", "'topics.camera_pose'.*7 items"),
        (NEEDED % ", camera_pose: [0, 0, 0, 0, 0, 0, 2]", "quaternion .* must have norm 1"),
        (NEEDED % ", hand_pose: 3", "'topics.hand_pose': .*string"),
        ("object: {mesh: a.obj, scale: -1}\n" + NEEDED % "", "'object.scale'.*greater than 0"),
        ("object: {scale: 1}\n" + NEEDED % "", "'object.mesh' is missing"),
    ],
)
def test_a_map_with_a_mistake_is_refused_in_one_sentence_that_names_it(tmp_path, text, message):
    with pytest.raises(RecordingError, match=message) as error:
        load(tmp_path, text)
    assert "\n" not in str(error.value)
    assert "map.yaml" in str(error.value)


def test_a_map_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="cannot read the topic map .*No such file"):
        load_topics(tmp_path / "nothing.yaml")


def test_pads_files_and_symmetry_files_are_relative_to_the_map_and_numbers_are_names(tmp_path):
    for name in ("pads.yaml", "models_info.json", "my.ply"):
        (tmp_path / name).write_text("")
    topic_map = load(
        tmp_path,
        "pads: pads.yaml\nobject: {mesh: my.ply, resolution: 200, symmetry: 'models_info.json#5'}\n"
        "topics: {joints: /j, contacts: {topic: /c, names: [0, 1, tip]}}",
    )
    assert topic_map.pads == str(tmp_path / "pads.yaml")
    assert topic_map.object.symmetry == str(tmp_path / "models_info.json") + "#5"
    assert topic_map.object.resolution == 200
    assert topic_map.topics.contacts.names == ("0", "1", "tip")
    axis = load(tmp_path, f"object: {{mesh: my.ply, symmetry: z}}\n{NEEDED % ''}").object
    assert axis.symmetry == "z"

# SPDX-License-Identifier: MIT
"""What is mutated, and how each is used: by the library, then by a command."""

from __future__ import annotations

import io
import os
import shutil
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import gtsam
import numpy as np
import trimesh
from held_box import HAND_XML, PADS, box_obj, write_grasp

from vtgtsam import GridSdf, build_sdf, cli, evaluate, load_hand, read_recording
from vtgtsam.config import EstimatorConfig
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.pose_files import PoseFiles
from vtgtsam.recording.topics import load_topics

URDF = """<robot name="clamp"><link name="palm"><collision name="pad_a"><origin xyz="0 0 0.01"/><geometry>
<box size="0.02 0.02 0.004"/></geometry></collision></link><link name="tip"><inertial><mass value="0.1"/><inertia
ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">
<parent link="palm"/><child link="tip"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint></robot>"""
TOPICS = """hand: isyhand
pads: "pad_*"
object: {mesh: box.obj, scale: 1.0, origin: [0, 0, 0.01]}
topics:
  joints: /joint_states
  contacts: {topic: /tactile/contacts, names: [pad_xp, pad_xn, pad_yp, pad_yn], threshold: 0.15}
  hand_pose: /hand/pose
  vision: {topic: /vision/object_pose, latency: 0.06, frame: camera}
  camera_pose: [0.6, 0, 0.576, 0, 0, 0, 1]
  truth: /truth/object_pose
"""
CONFIG = """method: vis+tac+pen
iterations: 5
w_vis: {rotation: 100.0, translation: 1.0e+4}
w_pen: 1.0e+6
log_theta_vis: 5.0
recover: true
"""
PAD_FILE = """hand: hand.xml
pads:
  - {name: pad_a, body: b, pos: [0, 0, 0.01], size: [0.02, 0.02], normal: [0, 0, 1]}
  - {name: pad_b, geom: g, face: +z, size: [0.01, 0.01]}
"""
BODY = """<mujoco model="h"><default><geom rgba="1 0 0 1"/></default><asset><texture name="t" type="2d" builtin="flat"
width="8" height="8"/><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody><body name="b"><joint
name="j" range="-1 1"/><geom name="g" type="box" size="0.02 0.02 0.02"/><replicate count="3" offset="0.1 0 0">
<geom size="0.01"/></replicate></body></worldbody></mujoco>"""


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    Attributes:
        names: File names of its seeds; the suffix decides what reads them.
        seeds: Makes the seeds' contents in a folder, in that order.
        use: Puts a mutated file, which lies in the folder, to use; answers with what is wrong, or "".
    """

    names: tuple[str, ...]
    seeds: Callable[[Path], list[bytes]]
    use: Callable[[Path, Path, np.random.Generator], str]


def library(call: Callable[[], object]) -> str:
    """Call it; only our own errors and the system's may come out."""
    try:
        call()
    except (VtgtsamError, OSError):
        return ""
    except Exception:
        return "the library raised\n" + traceback.format_exc()
    return ""


def command(*arguments: object) -> str:
    """Run the command line in this process; answers with what is wrong."""
    sys.argv = ["vtgtsam", *map(str, arguments)]
    said = io.StringIO()
    out, err, sys.stdout, sys.stderr = sys.stdout, sys.stderr, said, said
    try:
        cli.main()
        code: object = 0
    except SystemExit as stopped:
        code = stopped.code or 0
    finally:
        sys.stdout, sys.stderr = out, err
    text = said.getvalue()
    print(text)
    if "Traceback" in text:
        return f"{arguments[0]} shows a traceback:\n{text[-3000:]}"
    if code not in (0, 1, 2, 3):
        return f"{arguments[0]} ends with code {code}"
    if not all(line.isprintable() for line in text.splitlines()) or "\x1b" in text:
        return f"{arguments[0]} prints control characters: {text[-1000:]!r}"
    return ""


def _recordings(folder: Path) -> list[bytes]:
    write_grasp(folder / "a.mcap", frames=6)
    write_grasp(folder / "b.mcap", frames=3, truth=False, silent=(1, 2))
    return [(folder / name).read_bytes() for name in ("a.mcap", "b.mcap")]


def _content(path: Path) -> list[object]:
    """All that the estimator gets from a recording."""
    recording = read_recording(path)
    frames = [
        (m.time, _plain(m.contacts), _plain(m.joints), _plain(m.T_wh), _plain(m.T_wo_visual))
        for m in recording.measurements()
    ]
    return [frames, recording.object.sha256, recording.hand.pad_names, recording.warnings]


def _plain(value: object) -> object:
    """Numbers as lists, which compare."""
    if isinstance(value, gtsam.Pose3):
        value = value.matrix()
    return value.tolist() if isinstance(value, np.ndarray) else value


_WHOLE: list[list[object]] = []  # the seeds' content


def _use_recording(path: Path, folder: Path, rng: np.random.Generator) -> str:
    if not _WHOLE:
        _WHOLE.extend(_content(folder / name) for name in ("a.mcap", "b.mcap"))
    found: list[list[object]] = []

    def read() -> None:
        found.append(_content(path))

    problem = library(read)
    if not problem and found and found[0][-1] == [] and found[0] not in _WHOLE:
        problem = "a changed recording is read without a word, and gives other measurements"
    return problem or command("inspect", path)


def _contents(folder: Path) -> list[bytes]:
    metadata = b"hand=clamp\nobject=box\nobject_scale=1.0\nobject_origin=0 0 0\nobject_symmetry={}\ndataset=vary\n"
    return [metadata, HAND_XML.encode(), box_obj(), b"0 0.5 1.0 1.05 1.1 -0.2 0 1 nan 3"]


def _use_contents(path: Path, folder: Path, rng: np.random.Generator) -> str:
    """A sound file whose contents are a stranger's."""
    data, whole = path.read_bytes(), _contents(folder)
    place = {"metadata.txt": 0, "hand.xml": 1, "object.obj": 2, "numbers.txt": 3}[path.name]
    whole[place] = data
    pairs = (line.partition("=") for line in whole[0].decode(errors="replace").split("\n"))
    info = {key: value for key, _, value in pairs}
    values = [float(w) if _is_float(w) else 0.0 for w in whole[3].decode(errors="replace").split()]
    target = folder / "made.mcap"
    hand = whole[1].decode(errors="replace").encode("utf-8", errors="replace").decode()
    with RecordingWriter(target, info, hand_xml=hand, mesh=whole[2]) as writer:
        for k, value in enumerate(values[:100]):
            t = 1.0 + 0.033 * k if rng.random() < 0.8 else value
            try:
                writer.joint_states(t, [f"j_{name}" for name in PADS], np.full(4, value))
                writer.tactile(t, PADS, np.full(4, value), np.ones(4))
                writer.hand_pose(t, gtsam.Pose3())
                writer.object_pose(t, gtsam.Pose3(gtsam.Rot3(), np.full(3, value)))
            except ValueError:
                continue  # what the writer refuses
    out = folder / "out"
    return library(lambda: _content(target)) or (
        command("inspect", target)
        if rng.random() < 0.7
        else command("evaluate", target, "--out", out, "--methods", "vis")
    )


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _hands(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=3)
    return [HAND_XML.encode(), BODY.encode(), URDF.encode(), PAD_FILE.encode()]


def _use_hand(path: Path, folder: Path, rng: np.random.Generator) -> str:
    (folder / ("hand.xml" if path.suffix == ".yaml" else "unused.xml")).write_text(BODY)

    def use() -> None:
        hand = load_hand(path)
        T = hand.pad_transforms(dict.fromkeys(hand.joint_names, 0.0))
        assert np.isfinite(T).all(), "pads are nowhere"

    return library(use) or command("inspect", folder / "whole.mcap", "--hand", path)


def _meshes(folder: Path) -> list[bytes]:
    box = trimesh.creation.box(extents=(0.04, 0.06, 0.08)).subdivide()
    kinds = ("obj", "ply_ascii", "ply", "stl", "stl_ascii", "glb", "off")
    exports = [
        box.export(file_type="ply", encoding="ascii")
        if kind == "ply_ascii"
        else box.export(file_type=kind)
        for kind in kinds
    ]
    return [data.encode() if isinstance(data, str) else data for data in exports]


def _use_mesh(path: Path, folder: Path, rng: np.random.Generator) -> str:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    return library(lambda: build_sdf(path, resolution=8)) or command(
        "check-mesh", path, "--resolution", 8
    )


def _yamls(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=3)
    (folder / "box.obj").write_bytes(box_obj())
    return [CONFIG.encode(), TOPICS.encode()]


def _use_yaml(path: Path, folder: Path, rng: np.random.Generator) -> str:
    if path.name == "topics.yaml":
        return library(lambda: load_topics(path)) or command(
            "inspect", folder / "whole.mcap", "--topics", path
        )
    options = ("--out", folder / "out", "--methods", "vis", "--config", path)
    return library(lambda: EstimatorConfig.from_yaml(path)) or command(
        "evaluate", folder / "whole.mcap", *options
    )


def _poses(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=6)
    tum = "# time x y z qx qy qz qw\n" + "".join(
        f"{1 + 0.033 * k:.6f} 0.1 0.2 0.3 0 0 0 1\n" for k in range(6)
    )
    bop = "scene_id,im_id,obj_id,score,R,t,time\n" + "".join(
        f"1,{k},1,1.0,1 0 0 0 1 0 0 0 1,100 200 300,-1\n" for k in range(6)
    )
    matrix = "1 0 0 0.1\n0 1 0 0.2\n0 0 1 0.3\n0 0 0 1\n"
    return [tum.encode(), bop.encode(), matrix.encode()]


def _use_poses(path: Path, folder: Path, rng: np.random.Generator) -> str:
    poses = path
    if path.name == "000001.txt":
        poses = folder / "matrices"
        poses.mkdir(exist_ok=True)
        for k in range(6):
            (poses / f"{k:06d}.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 1\n0 0 0 1\n")
        shutil.copy(path, poses / path.name)
    options = ("--out", folder / "attached.mcap", "--force")
    return library(lambda: PoseFiles.read(poses).poses) or command(
        "attach-vision", folder / "whole.mcap", poses, *options
    )


_RESULTS = (
    "metrics.parquet", "sequences.csv", "config.yaml", "estimates/whole.parquet", "metrics/whole.parquet",
    ".vtgtsam/files.json", ".vtgtsam/parts/whole.json",
)  # fmt: skip


def _results(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=6)
    evaluate(folder / "whole.mcap", ["vis", "vis+pen"], "tuned", folder / "results")
    return [(folder / "results" / name).read_bytes() for name in _RESULTS]


def _use_results(path: Path, folder: Path, rng: np.random.Generator) -> str:
    from vtgtsam.evaluation import report
    from vtgtsam.evaluation.tables import make_tables

    report.missing_packages = lambda: "figures are left out"  # they take seconds
    whole = (folder / "results" / "summary.csv").read_bytes()
    results = shutil.copytree(folder / "results", folder / "mutated")
    if rng.random() < 0.3:  # as older versions left it: nothing says what was made
        (results / ".vtgtsam" / "files.json").unlink()
    shutil.copy(path, results / next(n for n in _RESULTS if n.replace("/", "_") == path.name))
    sealed = (results / ".vtgtsam" / "files.json").is_file() and "json" not in path.name
    problem = library(lambda: make_tables(results)) or command("report", results)
    if not problem and sealed and (results / "summary.csv").read_bytes() != whole:
        return "a damaged folder gives another summary without a word"
    if problem or rng.random() < 0.8:
        return problem
    options = ("--out", results, "--methods", "vis,vis+pen", "--force")
    problem = command("evaluate", folder / "whole.mcap", *options)
    if not problem and (results / "summary.csv").read_bytes() != whole:
        problem = "evaluating again does not make the damaged folder good"
    return problem


def _caches(folder: Path) -> list[bytes]:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    (folder / "box.obj").write_bytes(box_obj())
    grid = build_sdf(folder / "box.obj", resolution=8)
    grid.save(folder / "field.npz")
    (entry,) = (folder / "cache" / "sdf").glob("*.npz")
    return [entry.read_bytes(), (folder / "field.npz").read_bytes()]


def _use_cache(path: Path, folder: Path, rng: np.random.Generator) -> str:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    if path.name == "field.npz":
        return library(lambda: GridSdf.load(path))
    whole = build_sdf(folder / "box.obj", resolution=8).values
    (entry,) = (folder / "cache" / "sdf").glob("*.npz")
    shutil.copy(path, entry)
    found: list[np.ndarray] = []
    problem = library(lambda: found.append(build_sdf(folder / "box.obj", resolution=8).values))
    if not problem and not (found and np.array_equal(found[0], whole)):
        problem = "a damaged cache entry gives other values"
    return problem


KINDS = {
    "recording": Kind(("a.mcap", "b.mcap"), _recordings, _use_recording),
    "contents": Kind(("metadata.txt", "hand.xml", "object.obj", "numbers.txt"), _contents, _use_contents),
    "hand": Kind(("box.xml", "body.xml", "clamp.urdf", "pads.yaml"), _hands, _use_hand),
    "mesh": Kind(
        ("a.obj", "a.ply", "b.ply", "a.stl", "b.stl", "a.glb", "a.off"), _meshes, _use_mesh
    ),
    "yaml": Kind(("config.yaml", "topics.yaml"), _yamls, _use_yaml),
    "poses": Kind(("tum.txt", "bop.csv", "000001.txt"), _poses, _use_poses),
    "results": Kind(tuple(n.replace("/", "_") for n in _RESULTS), _results, _use_results),
    "cache": Kind(("entry.npz", "field.npz"), _caches, _use_cache),
}  # fmt: skip

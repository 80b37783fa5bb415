# SPDX-License-Identifier: MIT
"""The files that pose estimators write, as they are: in the file's own unit, nothing converted.

========  =====================================================  ==========  =======  ======
kind      what                                                   instants    frame    unit
========  =====================================================  ==========  =======  ======
matrices  a folder of 4x4 matrices as .txt, one an image, as     by name     camera   m
          FoundationPose's ``ob_in_cam``
bop       csv of bop_toolkit: scene_id, im_id, obj_id, score,    by number   camera   mm
          R (9 numbers, row by row), t, time
tum       lines of "time x y z qx qy qz qw", as evo reads them   stamps [s]  world    m
========  =====================================================  ==========  =======  ======
"""

from __future__ import annotations

import csv
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Literal

import gtsam
import numpy as np

from ... import limits
from ...exceptions import RecordingError
from ...input.text import read_bytes
from ..messages import QUATERNION_TOLERANCE

Frame = Literal["world", "camera"]

CALENDAR_NS = 10**18  # [ns], a name as large as this is a stamp since 1970, not an image's number
LAST_NS = 2**63  # [ns], the year 2262
_BOP_COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t")
_TUM = re.compile(r"[\s,]+")


@dataclass(frozen=True, eq=False)
class PoseTable:
    """What a file says.

    Attributes:
        kind: Which format it has, in words.
        matrices: Poses, shape (N, 4, 4), translations in the file's unit.
        images: Number of the image of each pose, int64, shape (N,); None where there are stamps.
        stamps_ns: Stamp of each pose [ns], int64, shape (N,); None where there are numbers.
        unit: Metres per unit that the format prescribes.
        frame: Frame that the format prescribes, or that is usual.
    """

    kind: str
    matrices: np.ndarray
    images: np.ndarray | None
    stamps_ns: np.ndarray | None
    unit: float
    frame: Frame


def read_table(
    path: str | Path, scene: int | None = None, obj: int | None = None, time_scale: float = 1.0
) -> PoseTable:
    """Read a file or folder of poses, whatever format it has.

    Args:
        path: A folder of matrices, a BOP csv or a TUM file.
        scene: For BOP: the scene_id, needed where the file has several.
        obj: For BOP: the obj_id, needed where the scene has several.
        time_scale: For TUM: seconds per unit of the stamps.

    Raises:
        RecordingError: It is none of these, or a line or file of it makes no sense.
    """
    path = Path(path)
    if path.is_dir():
        return read_matrices(path)
    if not path.exists():
        raise RecordingError(f"{path} does not exist; give a folder or a file of poses")
    try:
        text = read_bytes(path, 64 * limits.TEXT_BYTES, RecordingError).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path} cannot be read as text: {error}") from None
    if text.lstrip().startswith("scene_id"):
        return read_bop(path, text, scene, obj)
    return read_tum(path, text, time_scale)


def read_matrices(folder: Path) -> PoseTable:
    """A folder of matrices. Names are numbers of images, or stamps ("12.033" [s], 19 digits [ns])."""
    files = sorted(folder.glob("*.txt"))
    if not files:
        raise RecordingError(f"{folder} holds no .txt files; expected a 4x4 matrix for each image")
    names = [_number(file) for file in files]
    stamped = [isinstance(name, float) or name >= CALENDAR_NS for name in names]
    if any(stamped) != all(stamped):
        raise RecordingError(
            f"{folder} names some files by stamps and some by numbers "
            f"({files[0].name} ... {files[-1].name}); keep one kind"
        )
    order = np.argsort(np.array(names), kind="stable")
    matrices = np.array([_matrix(files[i]) for i in order])
    sorted_names = [names[i] for i in order]
    if not all(stamped):
        images = np.array(sorted_names, dtype=np.int64)
        return PoseTable("4x4 matrices", matrices, images, None, 1.0, "camera")
    stamps = [n if isinstance(n, int) else round(n * 1e9) for n in sorted_names]
    return PoseTable("4x4 matrices", matrices, None, np.array(stamps), 1.0, "camera")


def read_bop(path: Path, text: str, scene: int | None, obj: int | None) -> PoseTable:
    """One object in one scene of a BOP csv; of several poses in an image that of the highest score."""
    rows = csv.DictReader(text.splitlines())
    missing = [name for name in _BOP_COLUMNS if name not in (rows.fieldnames or ())]
    if missing:
        raise RecordingError(f"{path} lacks BOP's columns {', '.join(missing)}")
    scenes: dict[int, dict[int, list[tuple[int, float, np.ndarray]]]]
    scenes = defaultdict(lambda: defaultdict(list))
    for number, row in enumerate(rows, start=2):
        try:
            ids = (int(row["scene_id"]), int(row["obj_id"]), int(row["im_id"]))
            if not 0 <= ids[2] < CALENDAR_NS:
                raise ValueError(f"{row['im_id']:.30} is no image's number")
            T = np.eye(4)
            T[:3, :3] = np.array(row["R"].split(), dtype=np.float64).reshape(3, 3)
            T[:3, 3] = np.array(row["t"].split(), dtype=np.float64)
            scenes[ids[0]][ids[1]].append((ids[2], float(row["score"]), T))
        except (ValueError, TypeError, AttributeError) as error:
            raise RecordingError(f"{path}, line {number} is no line of BOP's: {error}") from None
    objects = scenes[_chosen(scenes, scene, path, "scene", "--scene")]
    found = objects[_chosen(objects, obj, path, "object", "--object-id")]
    best = {image: T for image, _, T in sorted(found, key=lambda entry: entry[1])}
    images = np.array(sorted(best), dtype=np.int64)
    return PoseTable(
        "BOP csv", np.array([best[i] for i in images.tolist()]), images, None, 1e-3, "camera"
    )


def read_tum(path: Path, text: str, time_scale: float = 1.0) -> PoseTable:
    """Lines of "time x y z qx qy qz qw"; lines that begin with # are comments."""
    stamps, matrices, unit_ns = [], [], Decimal(str(time_scale)) * 10**9
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            time, *numbers = _TUM.split(line.strip())
            matrices.append(_from_numbers([float(word) for word in numbers]))
            # Exactly: nanoseconds since 1970 have more digits than a float.
            stamp = Decimal(time) * unit_ns
            stamps.append(round(stamp))
        except (ValueError, ArithmeticError):
            raise RecordingError(
                f"{path}, line {number}: expected 'time x y z qx qy qz qw' (TUM) or a csv that "
                f"begins with 'scene_id' (BOP), got {line.strip()[:60]!r}"
            ) from None
        if abs(stamps[-1]) >= LAST_NS:
            raise RecordingError(
                f"{path}, line {number}: {time} s is no instant; are the stamps nanoseconds? Give "
                "--time-scale 1e-9"
            )
    if not stamps:
        raise RecordingError(f"{path} holds no poses")
    return PoseTable("TUM file", np.array(matrices), None, np.array(stamps), 1.0, "world")


def _from_numbers(numbers: Sequence[float]) -> np.ndarray:
    """Matrix (4, 4) of x y z qx qy qz qw; NaN where the quaternion is none."""
    x, y, z, qx, qy, qz, qw = numbers
    n = float(np.linalg.norm([qx, qy, qz, qw]))
    if not abs(n - 1) < QUATERNION_TOLERANCE:
        return np.full((4, 4), np.nan)
    T = np.eye(4)
    T[:3, :3] = gtsam.Rot3.Quaternion(qw / n, qx / n, qy / n, qz / n).matrix()
    T[:3, 3] = x, y, z
    return T


def _number(file: Path) -> int | float:
    """The number at the end of a file's name; a float where it has a decimal point."""
    match = re.search(r"\d+(\.\d+)?$", file.stem)
    if match is None:
        raise RecordingError(
            f"{file} has no number in its name; expected the image's number or its stamp"
        )
    number = float(match[0]) if match[1] else int(match[0])
    if number * (1e9 if match[1] else 1) >= LAST_NS:
        raise RecordingError(f"{file}: the number in its name is neither an image's nor a stamp")
    return number


def _matrix(file: Path) -> np.ndarray:
    try:
        matrix = np.array(
            read_bytes(file, limits.TEXT_BYTES, RecordingError).split(), dtype=np.float64
        )
    except (ValueError, UnicodeDecodeError):
        matrix = np.empty(0)
    if matrix.size != 16:
        raise RecordingError(f"{file} holds no 4x4 matrix of numbers")
    return matrix.reshape(4, 4)


def _chosen(found: Iterable[int], wanted: int | None, path: Path, what: str, option: str) -> int:
    ids = sorted(found)
    if wanted is None and len(ids) == 1:
        return ids[0]
    if wanted in ids:
        return wanted
    if not ids:
        raise RecordingError(f"{path} holds no poses")
    listed = ", ".join(map(str, ids[:20])) + (", ..." if len(ids) > 20 else "")
    got = f"several {what}s" if wanted is None else f"no {what} {wanted}"
    raise RecordingError(f"{path} has {got}; choose one with {option}: {listed}")

# SPDX-License-Identifier: MIT
r"""A robot hand: joint angles in, pad poses out, by MuJoCo's kinematics.

    T_wp[k] = T_wh T_hb(q) T_bp[k]

b is the body that pad k is fixed to; T_bp puts the frame p on the centre of the pad's contact face.
The hand frame h is the frame in which the MJCF file's worldbody is written, or a URDF's root link.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from ..exceptions import HandError, NotFiniteError
from ..input.door import reading
from . import file as hand_file
from . import pad_boxes, placement
from .couplings import closed_chains, completed, couplings
from .pad_file import entries_text, is_pad_file, read_pad_file
from .pads import Pad, PadSet

if TYPE_CHECKING:
    import gtsam
    from numpy.typing import ArrayLike

_BUILT_IN = Path(__file__).parent
_log = logging.getLogger(__name__)


def built_in_hands() -> list[str]:
    """Names of the built-in hands."""
    return sorted(file.stem for file in _BUILT_IN.glob("*.xml"))


def load_hand(name_or_path: str | Path) -> HandModel:
    """A built-in hand by its name ("isyhand"), or a hand from an MJCF or URDF file.

    A pads file (YAML) that names its hand's file will do as well.

    Raises:
        HandError: The name is unknown, or the file is not a hand with pads.
    """
    if not isinstance(name_or_path, str | Path):
        raise ValueError(
            f"a hand is given by its name or the path of its file, got {type(name_or_path).__name__}"
        )
    known = built_in_hands()
    if name_or_path in known:
        return HandModel.from_mjcf(_BUILT_IN / f"{name_or_path}.xml")
    if not Path(name_or_path).is_file():
        raise HandError(
            f"unknown hand {str(name_or_path)!r}: expected one of {', '.join(known)}, "
            "or the path of an MJCF or URDF file"
        )
    if is_pad_file(name_or_path):
        hand = read_pad_file(name_or_path).hand
        if hand is None:
            raise HandError(
                f"{name_or_path} lists pads but does not say of which hand; add a line 'hand: ' with "
                "the path of its MJCF or URDF file"
            )
        return HandModel.from_mjcf(hand, pads=str(name_or_path))
    return HandModel.from_mjcf(name_or_path)


FINGER = 0.03  # [m], a slide is made as exactly as a hinge holds a link of this length


class HandModel(PadSet):
    """A hand with joints and pads.

    Holds one MuJoCo state: use it from one thread at a time. Copies and pickles are independent.

    Attributes:
        name: The hand's name, the file's model name.
        model: The MuJoCo model of the hand alone, frame h at the world's origin.
        joint_names: Names of the joints, in the model's order.
        coupled_joints: Those that the file makes follow another joint (mimic).
        pad_bodies: Id in the model of the body that each pad is fixed to, shape (K,).
        pad_boxes: Each pad's box on its body.
        moves_pads: Whether a pad moves with a joint, bool, shape (K, J).
        source: Path of the file, or None where the hand came from text.
        xml: The hand as MJCF text that needs no other file.
    """

    def __init__(self, name: str, model: mujoco.MjModel, pads: str, xml: str) -> None:
        """Prefer ``from_mjcf``.

        Args:
            name: The hand's name.
            model: The compiled hand.
            pads: Which boxes are pads, as ``pad_boxes.found`` takes it.
            xml: The hand as MJCF text that needs no other file.
        """
        self.pad_boxes = tuple(pad_boxes.found(model, pads))
        super().__init__(Pad(box.name, box.size[:2]) for box in self.pad_boxes)
        self.name = name
        self.model = model
        self.source: Path | None = None
        self.xml = xml
        self.joint_names = tuple(model.joint(i).name for i in range(model.njnt))
        self.pad_bodies = np.array([box.body for box in self.pad_boxes])
        self._T_bp = np.array([box.T_bp for box in self.pad_boxes])
        self._couplings = couplings(model)
        self.coupled_joints = tuple(self._couplings)
        self.moves_pads = _moves(model, self.pad_bodies)
        self._data = mujoco.MjData(model)

    def __str__(self) -> str:
        """Its joints and pads by name, in a few lines."""
        area = sum(float(np.prod(pad.size)) for pad in self.pads)
        return "\n".join(
            [
                f"hand {self.name}: {len(self.joint_names)} joints, {len(self)} pads of {1e4 * area:.1f} cm^2 in all",
                f"  joints: {', '.join(self.joint_names)}",
                f"  pads: {', '.join(self.pad_names)}",
            ]
        )

    @classmethod
    def from_mjcf(cls, path: str | Path, pads: str | Path = "pad_*") -> HandModel:
        """Read a hand from an MJCF or URDF file.

        Args:
            path: The file. Meshes that it names and that are missing are left out with a warning.
            pads: Which of its box sites are pads, with the wildcards of file names; where no site
                has such a name, which of its box geoms. +z points out of a pad. Or the path of a
                YAML file that lists the pads (``vtgtsam.hands.pad_file``).

        Raises:
            HandError: The file cannot be read, has no pads, or has a free joint.
        """
        if not isinstance(path, str | Path) or not isinstance(pads, str | Path):
            raise ValueError(
                "a hand's file is a path, and its pads a pattern of names or the path of a pads file, got "
                f"{type(path).__name__} and {type(pads).__name__}"
            )
        path = Path(path)
        with reading(path, HandError):
            spec = hand_file.read_spec(path)
            if is_pad_file(pads):
                pads = entries_text(read_pad_file(pads).pads)
            elif pads == "pad_*":
                pads = hand_file.pads_said(spec) or pads
            model = hand_file.compile_hand(spec)
            try:
                hand = cls(spec.modelname or path.stem, model, str(pads), "")
            except ValueError as error:  # of a pad's size or name
                raise HandError(f"{path}: {error}") from error
            hand.xml = hand_file.self_contained(path, spec, str(pads))
            hand.source = path
            warnings = placement.warnings_of(hand)
            if order := numbered_out_of_order(hand.joint_names):
                warnings.append(order)
            for warning in warnings:
                _log.warning("%s: %s", path, warning)
            return hand

    @classmethod
    def from_text(cls, xml: str) -> HandModel:
        """The hand that ``xml`` describes, the text of an earlier hand's attribute of that name.

        Raises:
            HandError: The text cannot be read, has no pads, or has a free joint.
        """
        with reading("the hand's text", HandError):
            spec = hand_file.parse_spec(xml)
            model = hand_file.compile_hand(spec)
            try:
                return cls(spec.modelname, model, hand_file.pads_said(spec) or "pad_*", xml)
            except ValueError as error:
                raise HandError(f"the hand's text: {error}") from error

    def pad_transforms(
        self,
        joints: Mapping[str, float] | ArrayLike,
        T_wh: gtsam.Pose3 | np.ndarray | None = None,
    ) -> np.ndarray:
        """Poses of the pads in the world, shape (K, 4, 4).

        Args:
            joints: Joint angles [rad], as ``joint_array`` takes them.
            T_wh: Pose of the hand's frame h in the world, Pose3 or shape (4, 4); None: they agree.

        Raises:
            ValueError: Joints are missing, too many or not finite.
        """
        self._data.qpos[:] = self.joint_array(joints)  # hinges and slides only: one number each
        mujoco.mj_kinematics(self.model, self._data)
        T_hb = np.zeros((len(self.pads), 4, 4))
        T_hb[:, :3, :3] = self._data.xmat[self.pad_bodies].reshape(-1, 3, 3)
        T_hb[:, :3, 3] = self._data.xpos[self.pad_bodies]
        T_hb[:, 3, 3] = 1.0
        T_hp: np.ndarray = T_hb @ self._T_bp
        return T_hp if T_wh is None else np.matmul(_matrix(T_wh), T_hp)

    @property
    def zero_units(self) -> np.ndarray:
        """By how much joints' zeros are off per radian of a hinge's, shape (J,): 1 for hinges, [m/rad] for slides."""
        hinge = self.model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        return np.where(hinge, 1.0, FINGER)

    def zero_jacobian(
        self,
        joints: Mapping[str, float] | ArrayLike,
        points_h: np.ndarray,
        gradients_h: np.ndarray,
    ) -> np.ndarray:
        """How the distances of points on the pads change with the joints' zeros, d phi_k / d dq_j, shape (K, J).

        The joints are at q - dq where ``joints`` says q, so this is -grad phi_k . dp_k/dq_j.

        Args:
            joints: Joint angles q [rad], as ``joint_array`` takes them.
            points_h: A point on each pad, in the hand [m], shape (K, 3).
            gradients_h: The gradient of its signed distance, in the hand, shape (K, 3).
        """
        self._data.qpos[:] = self.joint_array(joints)
        mujoco.mj_kinematics(self.model, self._data)
        axes, anchors = self._data.xaxis, self._data.xanchor
        # grad . (axis x (p - anchor)) = axis . (p x grad) - grad . (axis x anchor)
        turned = _cross(points_h, gradients_h) @ axes.T - gradients_h @ _cross(axes, anchors).T
        pushed = gradients_h @ axes.T
        hinge = self.model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        jacobian: np.ndarray = -np.where(hinge, turned, pushed) * self.moves_pads
        return jacobian

    def pad_points(
        self,
        joints: Mapping[str, float] | ArrayLike,
        T_wh: gtsam.Pose3 | np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """All pads' grid points in the world [m], shape (P, 3), and ``offsets``, shape (K + 1,).

        Pad k's points are ``points[offsets[k]:offsets[k + 1]]``. Arguments and errors as for
        ``pad_transforms``.
        """
        T_wp = self.pad_transforms(joints, T_wh)
        points = [
            pad.points_p @ T[:3, :3].T + T[:3, 3] for pad, T in zip(self.pads, T_wp, strict=True)
        ]
        return np.concatenate(points), self.offsets

    def joint_array(self, joints: Mapping[str, float] | ArrayLike) -> np.ndarray:
        """Joint angles in the order of ``joint_names`` [rad], shape (J,).

        Args:
            joints: An array in that order, or a mapping from name to angle. Other names are
                ignored. A joint that the hand's file couples to another one (URDF ``mimic``, MJCF
                ``equality``) may be left out of a mapping and then follows the other one.

        Raises:
            ValueError: Joints are missing, too many or not finite; the message lists them.
        """
        if isinstance(joints, Mapping):
            q = self._from_mapping(joints)
        else:
            q = np.asarray(joints, dtype=np.float64)
            if q.shape != (len(self.joint_names),):
                raise ValueError(
                    f"joints must be {len(self.joint_names)} angles in joint_names' order, "
                    f"got shape {q.shape}"
                )
        if not np.isfinite(q).all():
            bad = [
                name
                for name, angle in zip(self.joint_names, q, strict=True)
                if not np.isfinite(angle)
            ]
            raise NotFiniteError(f"joint angles must be finite, these are not: {', '.join(bad)}")
        return q

    def _from_mapping(self, joints: Mapping[str, float]) -> np.ndarray:
        try:
            return np.array([joints[name] for name in self.joint_names], dtype=np.float64)
        except KeyError:
            named = {str(name): angle for name, angle in joints.items()}  # YAML makes 0 of "0"
        known = completed(named, self._couplings)
        if missing := [name for name in self.joint_names if name not in known]:
            raise ValueError(f"joint angles are missing for: {', '.join(missing)}{self._hint()}")
        return np.array([known[name] for name in self.joint_names], dtype=np.float64)

    def _hint(self) -> str:
        """Why joints of a closed chain do not follow from the others."""
        if pairs := closed_chains(self.model):
            a, b = pairs[0]
            return (
                f"; the hand has a closed chain (its file ties {a} to {b}), which is not solved: give "
                "the angles of all its joints, or leave the chain's passive links out of the file"
            )
        return ""

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "_data"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._data = mujoco.MjData(self.model)


def numbered_out_of_order(joint_names: Sequence[str]) -> str | None:
    """A sentence where joints are named by numbers and stand in another order."""
    if not all(name.isdigit() for name in joint_names):
        return None
    numbers = [int(name) for name in joint_names]
    if numbers == sorted(numbers):
        return None
    return (
        f"the joints are named by numbers, in the order {', '.join(joint_names)}; an array of angles goes "
        "in this order, not in the motors': give a mapping from name to angle"
    )


def _moves(model: mujoco.MjModel, bodies: np.ndarray) -> np.ndarray:
    """Whether each body moves with each joint, bool, shape (K, J)."""
    moves = np.zeros((len(bodies), model.njnt), dtype=bool)
    for k, body in enumerate(bodies.tolist()):
        while body:
            moves[k, model.jnt_bodyid == body] = True
            body = int(model.body_parentid[body])
    return moves


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows, shape (N, 3): NumPy's own takes ten times as long for a few."""
    forth, back = [1, 2, 0], [2, 0, 1]
    crossed: np.ndarray = a[:, forth] * b[:, back] - a[:, back] * b[:, forth]
    return crossed


def _matrix(T: gtsam.Pose3 | np.ndarray) -> np.ndarray:
    matrix = np.asarray(T.matrix() if hasattr(T, "matrix") else T)
    if matrix.shape != (4, 4) or matrix.dtype.kind not in "fiu":
        raise ValueError(f"T_wh must be a Pose3 or have shape (4, 4), got {T!r:.80}")
    return matrix

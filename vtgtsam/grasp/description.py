# SPDX-License-Identifier: MIT
"""How a hand grasps, as data: which joints close, in which order, and where its palm is.

With the hand's MJCF or URDF this is all that simulator and live loop need to know to close a hand.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pydantic

from ..exceptions import HandError
from ..input.text import read_yaml

if TYPE_CHECKING:
    from .. import HandModel

_BUILT_IN = Path(__file__).parent
Vector = tuple[float, float, float]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Palm(_Strict):
    """The palm in the hand's frame: a point on its surface [m] and two directions."""

    center: Vector
    normal: Vector
    fingers: Vector

    def level(self) -> np.ndarray:
        """Rotation R_wh, shape (3, 3), that turns the palm up and the fingers along +x."""
        z = np.array(self.normal) / np.linalg.norm(self.normal)
        x = np.array(self.fingers) - np.dot(self.fingers, z) * z
        x /= np.linalg.norm(x)
        R_wh: np.ndarray = np.array([x, np.cross(z, x), z])
        return R_wh


class Forearm(_Strict):
    """A cylinder in the hand's frame that carries the hand in pictures; nothing touches it."""

    start: Vector = pydantic.Field(alias="from")
    end: Vector = pydantic.Field(alias="to")
    radius: float


class GraspDescription(_Strict):
    """How a hand grasps.

    Attributes:
        hand: Name or path of the hand; a relative path is relative to the description's file.
        pads: Which of the hand's boxes are pads, or a YAML file of pads, also relative to this one.
        fingers: The joints of each finger that close it, inner joint first.
        thumb: The same for the thumb, which closes after the fingers.
        start: Angles of the open hand [rad]; joints not named start at 0 and, unless they belong to a
            finger or the thumb, stay where they start.
        opens: Joints that close the hand by a negative angle.
        palm: Where objects are put, and how the hand is held.
        forearm: For pictures.
    """

    hand: str
    pads: str = "pad_*"
    fingers: tuple[tuple[str, ...], ...]
    thumb: tuple[str, ...] = ()
    start: dict[str, float] = {}
    opens: tuple[str, ...] = ()
    palm: Palm
    forearm: Forearm | None = None

    def load_hand(self) -> HandModel:
        """The hand that this describes."""
        from .. import HandModel, load_hand

        path = Path(self.hand)
        return HandModel.from_mjcf(path, self.pads) if path.is_file() else load_hand(self.hand)

    def sign(self, joint: str) -> float:
        """+1 where a positive angle closes, -1 where a negative one does."""
        return -1.0 if joint in self.opens else 1.0

    def ranks(self) -> dict[str, int]:
        """Place of each closing joint in its finger: 0 the inner one, and so on."""
        return {j: rank for chain in (*self.fingers, self.thumb) for rank, j in enumerate(chain)}

    def check(self, hand: HandModel) -> None:
        """Refuse names of joints that the hand does not have, and closing joints that slide.

        Raises:
            HandError: There are such joints; the message lists them.
        """
        named = {*self.ranks(), *self.start, *self.opens}
        if unknown := sorted(named - set(hand.joint_names)):
            raise HandError(
                f"the description of hand {hand.name!r} names joints it does not have: "
                f"{', '.join(unknown)}; it has {', '.join(hand.joint_names)}"
            )
        import mujoco

        slides = hand.model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        sliding = {name for name, slide in zip(hand.joint_names, slides, strict=True) if slide}
        if closing := sorted(sliding & set(self.ranks())):
            raise HandError(
                f"the grasp closes hinges, with gains in N m/rad; these joints of hand {hand.name!r} "
                f"slide: {', '.join(closing)}"
            )


def load_grasp(name_or_path: str | Path = "isyhand", *folders: Path) -> GraspDescription:
    """The description of a built-in hand by its name, or one from a YAML file.

    Args:
        name_or_path: A name, or the file.
        folders: Where names are looked for besides here.

    Raises:
        HandError: There is no such description, or it is wrong.
    """
    path = Path(name_or_path)
    if not path.is_file():
        named = [file for folder in (_BUILT_IN, *folders) for file in folder.glob("*.yaml")]
        path = next((file for file in named if file.stem == str(name_or_path)), path)
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in named))
        raise HandError(
            f"no description of a hand {str(name_or_path)!r}: known are {known}, or give a YAML file"
        )
    try:
        content: dict[str, Any] = read_yaml(path, HandError)
        for key in ("hand", "pads") if isinstance(content, dict) else ():
            if (path.parent / str(content.get(key))).is_file():
                content[key] = str(path.parent / content[key])
        return GraspDescription.model_validate(content)
    except pydantic.ValidationError as error:
        raise HandError(f"{path}: {' '.join(str(error).split())}") from error

# SPDX-License-Identifier: MIT
"""How old a stream may be, and what happens when it is older.

| stream | older than | what happens |
|---|---|---|
| joints, pads | 0.1 s | the fingers wait where they are; nothing is fused |
| joints, pads | 1 s | the run ends, torque off |
| vision | 0.2 s | a person is told; touch and the hand's shape go on alone |

What a single servo does wrong (silence, heat, overload) is judged in ``hardware.servo.safety``, in the
cycle in which it shows.
"""

from __future__ import annotations

from collections.abc import Mapping

from vtgtsam.exceptions import LiveError
from vtgtsam.live.inputs import Inputs

MAX_AGE = {"joints": 0.1, "pads": 0.1, "vision": 0.2}  # [s]
GIVE_UP = 1.0  # [s], joints and pads
_STREAM = {"joints": "joints", "pads": "contacts", "vision": "vision"}

_ADVICE = {
    "joints": "is the computer too busy, or the adapter slow (`python -m hardware check`)?",
    "pads": "is the pad board's cable loose (`python -m hardware check`)?",
}


def ages(inputs: Inputs, now_ns: int) -> dict[str, float]:
    """How old the newest sample of each stream is [s]; infinity where there is none."""
    return {name: inputs.age(stream, now_ns) for name, stream in _STREAM.items()}


def stale(ages: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the streams that are too old to be used."""
    return tuple(name for name, age in ages.items() if age > MAX_AGE[name])


def may_move(ages: Mapping[str, float]) -> bool:
    """Whether the fingers may go on closing."""
    return not {"joints", "pads"} & set(stale(ages))


def check_ages(ages: Mapping[str, float], give_up: float = GIVE_UP) -> None:
    """LiveError where a stream that the hand cannot do without has been silent for ``give_up`` [s]."""
    for name, advice in _ADVICE.items():
        if ages.get(name, 0.0) > give_up:
            raise LiveError(f"no {name} for {ages[name]:.1f} s: {advice}")

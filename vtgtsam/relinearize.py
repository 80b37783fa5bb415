# SPDX-License-Identifier: MIT
r"""A solved frame that begins from another belief: its factors stay linearized while its pose moves little.

Where a late visual pose changes what was believed before a frame, the frame's own cost has not changed. About the
pose T_ho* where it was solved, with information S and gradient g of its factors there, the least of

    n/2 ||Log(T_ho'(t-1)^-1 T_ho)||^2_Lambda' + (frame),    T_ho = T_ho* Exp(d)

lies at (n Lambda' + S) d = -g - n Lambda' r with r = Log(T_ho'(t-1)^-1 T_ho*), and no pad is searched again. Farther
away than a threshold the frame has to be solved anew, as in iSAM2 (Kaess et al. 2012, fluid relinearization).
"""

from __future__ import annotations

import math

import gtsam

from .config import EstimatorConfig
from .covariance import LEVER, known_inverse
from .history import Past
from .memory import Belief, expectation

NEAR = 2e-3  # [m], a radian counted as ``LEVER``: so far a frame's factors count as linear


def moved(past: Past, before: Belief | None, config: EstimatorConfig) -> Past | None:
    """The frame as it is where something else was believed before it; None where it has to be solved anew."""
    expected = expectation(before, past.frame.time, past.mode, config)
    seen = past.frame.T_ho_visual is not None  # how much that counts depends on where the pose is
    if expected is None or past.after is None or past.says is None or seen:
        return None
    assert before is not None
    weighted = expected.repetitions * expected.information
    r = gtsam.Pose3.Logmap(expected.T_ho.between(past.after.T_ho))
    step = known_inverse(weighted + past.says.information) @ -(past.says.gradient + weighted @ r)
    if not math.hypot(*(step[:3] * LEVER), *step[3:]) < NEAR:
        return None
    T_ho = past.after.T_ho.retract(step)
    knowledge = expected.posterior(past.says)
    after = Belief(past.frame.time, T_ho, knowledge, before.refused_since)
    return past._replace(before=before, after=after)

# SPDX-License-Identifier: MIT
"""Whether grasps, slips and drops are noticed, how soon, and how often where there are none.

Grasps come from the simulator's physics, with contacts and joints as it makes them; vision is the truth with noise as
large as a tracker's, so that no image has to be drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gtsam
import numpy as np

from sim.calibration import CalibrationError
from sim.events import EVENTS
from sim.sampling import NotGraspable
from sim.sequence import SequenceName, Settings, make_trajectory
from sim.simulate import Trajectory, event_instant
from sim.world import World
from vtgtsam import Measurement, PoseEstimator

from .report import save, table

SIGMA = (0.03, 0.002)  # [rad], [m], of vision
SETTLED = 0.5  # [s], an event noticed sooner before it than this belongs to it
NOTICED = {"slip": "slipping", "drop": "dropped"}
LIFTED = 4.5  # [s], from then on the hand has closed


def run(objects: Sequence[str], seed: int) -> None:
    """Measure, and write ``events.md`` and ``events.json``."""
    rows = []
    for event in (None, *EVENTS):
        results = [found for name in objects if (found := of_grasp(name, event, seed)) is not None]
        rows.append(_row(event, results))
    text = f"One grasp each of {len(objects)} objects, each on a robot of its own with calibration error.\n\n"
    save("events", text + table(rows), {"rows": rows}, {})


def of_grasp(name: str, event: str | None, seed: int) -> dict[str, Any] | None:
    """What is noticed in one grasp; None where the hand cannot hold the object or the event does not come about."""
    try:
        world, trajectory = make_trajectory(
            Settings("vary", seed, event=event), SequenceName(name, 0)
        )
    except NotGraspable:
        return None
    error = CalibrationError.of_robot(seed, len(world.hand.joint_names))
    noticed = noticed_events(world, trajectory, error, np.random.default_rng(seed))
    truly = None if event is None else event_instant(world, trajectory, event)
    return {"truly": truly, "noticed": noticed, "seconds": float(trajectory.time[-1])}


def noticed_events(
    world: World, trajectory: Trajectory, error: CalibrationError, rng: np.random.Generator
) -> list[tuple[float, str]]:
    """The estimator's events and their instants [s]."""
    estimator = PoseEstimator(world.hand, world.obj)
    t, found = trajectory, []
    for time, T_wo in zip(t.frame_time.tolist(), t.frame_T_wo, strict=True):
        n = np.searchsorted(t.time, time + 1e-9, side="right") - 1
        noise = gtsam.Pose3.Expmap(rng.normal(size=6) * np.repeat(SIGMA, 3))
        estimate = estimator.update(
            Measurement(
                time=time,
                contacts=t.contacts[n],
                joints=t.joints[n] + error.joints,
                T_wh=gtsam.Pose3(t.T_wh[n]),
                T_wo_visual=error.T_error.compose(gtsam.Pose3(T_wo)).compose(noise),
                visual_sigma=SIGMA,
            )
        )
        found += [(time, str(word)) for word in estimate.events]
    return found


def _row(event: str | None, results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How often each event is noticed; what is noticed where nothing happens is a false alarm."""
    wanted = NOTICED.get(event or "")
    delays, false = [], 0
    for result in results:
        truly = result["truly"]
        of_event = [
            time - truly
            for time, word in result["noticed"]
            if word == wanted and time >= truly - SETTLED
        ]
        delays += of_event[:1]
        until = np.inf if truly is None else truly - SETTLED
        false += sum(
            LIFTED < time < until and word != "grasped" for time, word in result["noticed"]
        )
    grasped = sum(any(word == "grasped" for _, word in r["noticed"]) for r in results)
    return {
        "what happens": event or "nothing",
        "grasps": len(results),
        "grasped noticed": grasped,
        "event noticed": len(delays) if wanted else None,
        "median delay [s]": float(np.median(delays)) if delays else None,
        "longest delay [s]": max(delays, default=None),
        "false alarms": false,
    }

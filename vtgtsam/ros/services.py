# SPDX-License-Identifier: MIT
"""The node's services, all of std_srvs/srv/Trigger; each only asks the fusing thread."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from ..live.files import Files
from ..live.fusion import Fusion
from ..live.inputs import Inputs

RECENT = 1.0  # [s], a visual pose that the estimate may start again from


class Services:
    """``~/reset``, ``~/restart_from_vision``, ``~/start_recording``, ``~/stop_recording``.

    Args:
        node: The node.
        inputs: The streams.
        fusion: The fusing thread.
        files: The recordings.
    """

    def __init__(self, node: Node, inputs: Inputs, fusion: Fusion, files: Files) -> None:
        from std_srvs.srv import Trigger

        self._inputs, self._fusion, self._files = inputs, fusion, files
        for name in ("reset", "restart_from_vision", "start_recording", "stop_recording"):
            node.create_service(Trigger, f"~/{name}", getattr(self, f"_{name}"))

    def _reset(self, request: Any, response: Any) -> Any:
        self._fusion.restart()
        return _answer(
            response, True, "all is forgotten; the estimate starts at the next visual pose"
        )

    def _restart_from_vision(self, request: Any, response: Any) -> Any:
        silence = self._inputs.silence("vision")
        recent = silence < RECENT
        self._fusion.restart(at_last_vision=recent)
        if recent:
            return _answer(response, True, "the estimate starts at the last visual pose")
        return _answer(
            response,
            False,
            f"no visual pose for {silence:.1f} s; the estimate starts when the next one comes",
        )

    def _start_recording(self, request: Any, response: Any) -> Any:
        if self._inputs.recorder.on:
            return _answer(response, False, f"recording to {self._inputs.recorder.path} already")
        path = self._files.next()
        self._inputs.begin_recording()
        return _answer(response, True, f"recording to {path.absolute()}")

    def _stop_recording(self, request: Any, response: Any) -> Any:
        recorder = self._inputs.recorder
        if not recorder.on:
            return _answer(response, False, "nothing is being recorded")
        recorder.end()
        return _answer(response, True, f"recorded to {recorder.path}")


def _answer(response: Any, success: bool, message: str) -> Any:
    response.success, response.message = success, message
    return response

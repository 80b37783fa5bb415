# SPDX-License-Identifier: MIT
"""A process that solves grasps while this one goes on: GTSAM holds the interpreter lock while it solves.

``python -m vtgtsam.calibration.background`` is that process. It is given hand and object once, then questions, and
gives answers, pickled, by its standard input and output.
"""

from __future__ import annotations

import logging
import os
import pickle
import queue
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from ..hands.model import HandModel
from ..objects import ObjectModel
from .one_grasp import Answer, Question, answer_to

ENDING = 2.0  # [s], the most that the process may take to end by itself
NICE = 10  # others go first

logger = logging.getLogger(__name__)


class Background:
    """Solves one grasp at a time in a process of its own.

    Args:
        hand: The hand.
        obj: The object.
    """

    def __init__(self, hand: HandModel, obj: ObjectModel) -> None:
        package = str(Path(__file__).parents[2])
        paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "vtgtsam.calibration.background"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"},
        )
        self._setup = hand, obj
        self._questions: queue.SimpleQueue[Question | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self.busy = False
        self._closing = False
        self._thread = threading.Thread(target=self._talk, name="calibration", daemon=True)
        self._thread.start()

    def ask(self, question: Question) -> None:
        """Have a grasp solved; only when not busy."""
        self.busy = True
        self._questions.put(question._replace(grasp=_alone(question)))

    def answer(self) -> Answer | None:
        """The answer, once it is there."""
        with suppress(queue.Empty):
            answer = self._answers.get_nowait()
            self.busy = False
            return answer
        return None

    def close(self) -> None:
        """End the process; what it is at is given up."""
        self._closing = True
        self._questions.put(None)
        self._thread.join(ENDING)
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()

    def _talk(self) -> None:
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        try:
            _send(stdin, self._setup)
            while (question := self._questions.get()) is not None:
                _send(stdin, question)
                self._answers.put(pickle.load(stdout))
            stdin.close()
            self._process.wait(ENDING)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            # Stays busy: nothing is asked any more.
            if not self._closing:
                logger.warning(
                    "the process that calibrates has ended, poses go on without: %r", error
                )
        except subprocess.TimeoutExpired:
            pass
        finally:
            with suppress(OSError):
                stdin.close()
            stdout.close()


def _alone(question: Question) -> Any:
    """The grasp without its hand and object, which the process has."""
    return question.grasp._replace(hand=None, obj=None)  # type: ignore[arg-type]


def _send(stream: Any, what: object) -> None:
    pickle.dump(what, stream, protocol=pickle.HIGHEST_PROTOCOL)
    stream.flush()


def _serve(questions: BinaryIO, answers: BinaryIO) -> None:
    """Answer until the questions end."""
    with suppress(EOFError):
        hand, obj = pickle.load(questions)
        while True:
            question: Question = pickle.load(questions)
            grasp = question.grasp._replace(hand=hand, obj=obj)
            _send(answers, answer_to(question._replace(grasp=grasp)))


def main() -> None:
    """The process."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints must not be taken for an answer
    with suppress(OSError):
        os.nice(NICE)
    with suppress(KeyboardInterrupt, BrokenPipeError):
        _serve(sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""The node: topics in, one fusing thread, the object's pose out.

    callbacks (main thread)  ->  Inputs  ->  fusing thread: estimate, pose, transform
                                                 |
                                             telling thread: markers, diagnostics

Callbacks only store. The fusing thread publishes what it has fused before it looks for the next frame; the telling
thread looks at the last frame ten times a second. Recordings are written by a thread of their own.
"""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gtsam
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from ..exceptions import LiveError
from ..live.files import Files
from ..live.fusion import Fused, Fusion, vision_hold
from ..live.inputs import Inputs
from ..live.recorder import Recorder
from ..live.slots import PoseSlot
from ..live.threads import Ticker, Workers
from ..recording.topics import TfPose
from .calibrating import Calibrating
from .depth import DepthTracking
from .health import (
    Condition,
    EstimateHealth,
    Level,
    Link,
    TopicHealth,
    diagnostics_message,
    in_words,
    judge_recorder,
)
from .intake import (
    camera_pose_intake,
    contacts_intake,
    hand_pose_intake,
    joints_intake,
    vision_intake,
)
from .markers import Markers
from .outgoing import pose_message, transform_message
from .publisher_clock import PublisherClock
from .services import Services
from .settings import Given, Loaded
from .subscriptions import Subscriptions
from .transforms import tf_intakes

if TYPE_CHECKING:
    from ..live.view import Where

log = logging.getLogger(__name__)

TELLING = 10.0  # [Hz], markers, and a look at what has changed
DIAGNOSTICS = 1.0  # [s], between diagnostics where nothing changes
LOOKING = 0.25  # [s], between looks at who publishes what


class PoseNode:
    """A robot's node; a context manager, whose way out ends everything.

    Args:
        node: The ROS node.
        given: Its parameters.
        loaded: What they name.
        where: Where to show how it goes, or None.

    Attributes:
        inputs: The streams.
        fusion: The estimator's thread.
    """

    def __init__(
        self, node: Node, given: Given, loaded: Loaded, where: Where | None = None
    ) -> None:
        self._node, self._given, self._loaded, self._where = node, given, loaded, where
        self._words = ""
        self._stack = ExitStack()
        self._clock = PublisherClock(lambda: int(node.get_clock().now().nanoseconds))
        self._calibrating = Calibrating(given, loaded)
        estimator = self._calibrating.estimator
        self.files = _files(given, loaded, vision_hold(estimator))
        self.recorder = Recorder(None, self.files.open)
        self.inputs = Inputs(
            loaded.hand.joint_names,
            loaded.hand.pad_names,
            self._clock.now_ns,
            self.recorder,
            hold_ns=round(1e9 * vision_hold(estimator)),
            hand_moves="hand_pose" in loaded.map.topics.model_fields_set,
        )
        self.inputs.on_forget = self._clock.restart
        self._calibrating.record_to(self.files, self.inputs)
        self.fusion = Fusion(
            self.inputs, estimator, self._clock.now_ns, self._publish, rate=given.rate
        )
        self._camera = _camera(loaded)
        self.inputs.on_rewrite = self._record_camera
        self._depth = self._depth_tracking()
        self._make_publishers()
        self._links = self._make_links()
        self._estimate_health = EstimateHealth(self.fusion, self._clock)
        self._event = threading.Event()  # something changed that people should hear of at once
        self._told: tuple[object, ...] = ()

    def __enter__(self) -> PoseNode:
        stack = self._stack
        stack.callback(self._keep)  # last on the way out: nothing is fused any more then
        self._markers = stack.enter_context(Markers(self._loaded.obj, self._given.world_frame))
        stack.enter_context(self.recorder)
        self._workers = stack.enter_context(Workers())
        if self._given.record:
            self.files.check()
            self.inputs.begin_recording()
        links = list(self._links.values())
        latched = [link for name, link in self._links.items() if name in LATCHED]
        subscriptions = Subscriptions(self._node, links, latched)
        self._node.create_timer(LOOKING, subscriptions.look)
        Services(self._node, self.inputs, self.fusion, self.files)
        self._workers.start("fusion", self.fusion.run)
        self._workers.start("telling", self._tell)
        if self._depth is not None:
            self._workers.start("depth", self._depth.run)
        self._show()
        return self

    def __exit__(self, *exception: Any) -> None:
        self._stack.__exit__(*exception)

    def spin(self, stop: threading.Event) -> None:
        """Take messages until ``stop`` is set.

        Raises:
            BaseException: What ended one of the threads.
        """
        executor = SingleThreadedExecutor()
        executor.add_node(self._node)
        try:
            while not stop.is_set() and rclpy.ok():
                executor.spin_once(timeout_sec=0.1)
                self._workers.check()
                self._calibrating.check(self._camera)
        finally:
            executor.shutdown()

    def _keep(self) -> None:
        if said := self._calibrating.end():
            self._node.get_logger().info(said)

    def _show(self) -> None:
        if self._where is None:
            return
        from ..live.view import LiveView, Setup

        setup = Setup(self._loaded.hand, self._loaded.obj, gtsam.Pose3())
        view = self._stack.enter_context(LiveView(self._where, setup))
        view.watch(self.inputs, self.fusion, self._clock.now_ns, words=lambda: self._words)

    def _make_publishers(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from visualization_msgs.msg import MarkerArray

        node, given = self._node, self._given
        self._pose = node.create_publisher(PoseWithCovarianceStamped, "~/object_pose", 10)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._marker = None
        if given.publish_markers:
            self._marker = node.create_publisher(MarkerArray, "~/markers", 10)
        self._tf = _tf_publisher(node) if given.publish_tf else None

    def _depth_tracking(self) -> DepthTracking | None:
        entry, loaded = self._loaded.map.topics.depth, self._loaded
        if entry is None:
            return None
        return DepthTracking(
            *(entry, loaded.hand, loaded.obj, self.inputs),
            *(self._camera, self.fusion, self._clock),
        )

    def _make_links(self) -> dict[str, Link]:
        topics, inputs, clock = self._loaded.map.topics, self.inputs, self._clock
        hand_given = "hand_pose" in topics.model_fields_set
        links = {
            "joints": Link(joints_intake(topics.joints, inputs, clock), Level.ERROR),
            "contacts": Link(contacts_intake(topics.contacts, inputs, clock), Level.ERROR),
        }
        if self._depth is None:
            links["vision"] = Link(vision_intake(topics, inputs, self._camera, clock), Level.WARN)
        else:
            links["depth"] = Link(self._depth.images, Level.WARN)
            links["camera_info"] = Link(self._depth.info, None)
            if self._depth.infrared is not None:
                links["infrared"] = Link(self._depth.infrared.intake, None)
        in_camera = topics.vision.frame == "camera" or self._depth is not None
        needed = Level.ERROR if in_camera else None
        if isinstance(topics.hand_pose, str):
            intake = hand_pose_intake(topics.hand_pose, inputs, clock)
            links["hand_pose"] = Link(intake, Level.WARN if hand_given else None)
        if isinstance(topics.camera_pose, str):
            links["camera_pose"] = Link(
                camera_pose_intake(topics.camera_pose, self._put_camera, clock), needed
            )
        wanted = {
            name: (value.tf, put)
            for name, value, put in (
                ("hand_pose", topics.hand_pose, inputs.put_hand_pose),
                ("camera_pose", topics.camera_pose, self._put_camera),
            )
            if isinstance(value, TfPose)
        }
        transforms = {topic: Link(intake, None) for topic, intake in tf_intakes(wanted).items()}
        if transforms:
            transforms["/tf"].needed = Level.WARN
        self._judged = {**links, **{name: transforms["/tf"] for name in wanted}}
        return {**links, **transforms}

    def _record_camera(self) -> None:
        T_wc = self._camera.newest
        if T_wc is not None:
            self.inputs.record("camera_pose", max(self._clock.now_ns(), 0), T_wc)

    def _put_camera(self, stamp_ns: int, T_wc: gtsam.Pose3) -> bool:
        with self.inputs.changed:
            known, taken = self._camera.newest is not None, self._camera.put(stamp_ns, T_wc)
            if taken and (self._camera.moves or not known):  # of one that stands, once is enough
                self.inputs.record("camera_pose", max(stamp_ns, 0), T_wc)
            return taken

    def _publish(self, fused: Fused) -> None:
        """In the fusing thread."""
        estimate, stamp_ns = fused.estimate, fused.cut.stamp_ns
        if estimate.T_wo is not None:
            frame = self._given.world_frame
            self._pose.publish(pose_message(stamp_ns, frame, estimate.T_wo, estimate.covariance))
            if self._tf is not None:
                child = self._given.object_frame or self._loaded.obj.name
                self._tf.publish(transform_message(stamp_ns, frame, child, estimate.T_wo))
        if estimate.events:
            at = f"{estimate.time:.2f} s"
            self._estimate_health.event = f"{', '.join(estimate.events)} at {at}"
            self._event.set()

    def _tell(self, stop: threading.Event) -> None:
        """Markers and diagnostics, in a thread of their own."""
        judges = self._judges()
        ticker, told, marked = Ticker(TELLING), float("-inf"), None
        while ticker.wait(stop):
            now, latest = time.monotonic(), self.fusion.latest
            marker = self._marker
            if latest is not None and latest is not marked and marker is not None:
                marked = latest
                if marker.get_subscription_count():
                    marker.publish(self._markers.of(latest))
            if self._changed(latest) or now - told >= DIAGNOSTICS:
                told = now
                conditions = [judge(now) for judge in judges]
                conditions.append(judge_recorder(self.recorder))
                if self._depth is not None:
                    conditions.append(Condition("vtgtsam: tracker", message=self._depth.state))
                self._words = in_words(conditions)
                stamp = self._node.get_clock().now().to_msg()
                self._diagnostics.publish(diagnostics_message(conditions, stamp))

    def _judges(self) -> list[Any]:
        poses = {"hand_pose": lambda: self.inputs.hand_pose, "camera_pose": lambda: self._camera}
        return [
            self._estimate_health.judge,
            *(
                TopicHealth(name, link, self.inputs, poses.get(name)).judge
                for name, link in self._judged.items()
            ),
        ]

    def _changed(self, latest: Fused | None) -> bool:
        """Whether status, faults or mode are others than those told last, or an event came."""
        now: tuple[object, ...] = ()
        if latest is not None:
            now = (latest.estimate.status, latest.estimate.faults, latest.estimate.mode)
        changed = now != self._told or self._event.is_set()
        self._told = now
        self._event.clear()
        return changed


LATCHED = ("hand_pose", "camera_pose", "/tf_static")


def _camera(loaded: Loaded) -> PoseSlot:
    camera = PoseSlot()
    fixed = loaded.map.topics.fixed_camera_pose()
    if fixed is not None:
        camera.put(0, fixed)
    return camera


def _files(given: Given, loaded: Loaded, hold: float) -> Files:
    path = (
        Path(given.record)
        if given.record
        else Path(time.strftime("vtgtsam_%Y-%m-%d_%H-%M-%S.mcap"))
    )
    more = {"dataset": "live", "tracker": loaded.map.topics.vision.topic}
    return Files(path, loaded.hand, loaded.obj, loaded.config, hold, more, loaded.calibration)


def _tf_publisher(node: Node) -> Any:
    """A publisher on /tf; None where tf2_msgs is not there."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        node.get_logger().info("tf2_msgs is not installed: no transform is published on /tf")
        return None
    return node.create_publisher(TFMessage, "/tf", 100)


def run(
    given: Given,
    arguments: Sequence[str],
    stop: threading.Event,
    where: Where | None = None,
) -> None:
    """Run the node until ``stop`` is set.

    Args:
        given: Parameters' defaults.
        arguments: ROS's own arguments, from ``--ros-args`` on.
        stop: Ends it.
        where: Where to show how it goes, or None.

    Raises:
        VtgtsamError: What the parameters name cannot be read, or the recording cannot be written.
    """
    from rclpy.signals import SignalHandlerOptions

    from .settings import load

    try:
        rclpy.init(args=list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        raise LiveError(f"ROS does not take its arguments: {error}") from None
    node = rclpy.create_node("vtgtsam")
    try:
        given = given.declared_on(node)
        loaded = load(given)
        with PoseNode(node, given, loaded, where) as robot:
            node.get_logger().info(
                f"{loaded.obj.name} in {loaded.hand.name}: poses on "
                f"{node.resolve_topic_name('~/object_pose')}"
            )
            gc.collect()
            gc.freeze()  # meshes and fields stay: looking through them again and again would make poses late
            robot.spin(stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()

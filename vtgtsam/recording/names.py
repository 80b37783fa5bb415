# SPDX-License-Identifier: MIT
"""Names inside a recording: topics, the metadata record, attachments."""

JOINTS = "/joint_states"
CONTACTS = "/tactile/contacts"
HAND_POSE = "/hand/pose"
VISION = "/vision/object_pose"
VISION_CORRELATION = "/vision/correlation"
TRUTH = "/truth/object_pose"
ESTIMATE = "/estimate/object_pose"
CALIBRATION = "/estimate/calibration"
CAMERA_POSE = "/camera/pose"
DEPTH = "/camera/depth"
COLOR = "/camera/color"
CAMERA_INFO = "/camera/info"

METADATA = "vtgtsam"
HAND_ATTACHMENT = "hand"  # without the suffix, which says what kind of file it is
OBJECT_ATTACHMENT = "object"
CALIBRATION_ATTACHMENT = "calibration.yaml"  # the one in force from the start of a live run
VISION_HOLD = (
    "vision_hold"  # in the metadata: how long a visual pose counted again in a live run [s]
)
CAMERA = "camera"  # in the metadata: the camera's name; the same name is the same camera
ROBOT = "robot"  # in the metadata: the robot's name
VISUAL_COVARIANCE = "visual_covariance"  # in the metadata: "tracker" where it is the tracker's own

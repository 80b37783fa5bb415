# SPDX-License-Identifier: MIT
"""Names inside the viewer: what is drawn beside a run's methods, plots, and the time line."""

TIME = "time"  # [s], of the recording's own clock

TRUTH = "truth"
TRACKER = "visual tracker"
LIVE = "live"
VISION = (TRACKER, "vis")  # the visual pose itself

WORLD = "world"
ADDS = "adds_mm"  # plots, one line a method
PAD_DISTANCE = "pad_distance_mm"  # one line a pad in contact
VISUAL_RESIDUAL = "visual_residual_mm"  # one line a method
WEIGHT = "visual_weight"
CONTACTS = "contacts"
WORDS = "streams"
LOG = "status"

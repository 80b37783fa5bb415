# SPDX-License-Identifier: MIT
"""The real hand: servos, tactile pads, wrist tag and camera, and emulators of them."""

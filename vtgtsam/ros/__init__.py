# SPDX-License-Identifier: MIT
"""The ROS 2 node: a robot's topics in, the object's pose out. ``vtgtsam ros`` runs it."""

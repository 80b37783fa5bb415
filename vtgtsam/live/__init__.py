# SPDX-License-Identifier: MIT
"""The estimator beside a running robot: streams of many paces, one thread that fuses, a recording that replays."""

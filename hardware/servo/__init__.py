# SPDX-License-Identifier: MIT
"""Servos: from bytes on the line (``bus``) to joints in radians (``hand``)."""

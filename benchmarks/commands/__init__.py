# SPDX-License-Identifier: MIT
"""The commands, which import what they run only when called: ``--help`` is fast."""

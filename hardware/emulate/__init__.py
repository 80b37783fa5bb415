# SPDX-License-Identifier: MIT
"""Devices that exist only in software, byte for byte. Asked for by name, never fallen back to."""

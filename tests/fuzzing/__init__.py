# SPDX-License-Identifier: MIT
"""Mutated files of every kind, through the library and the command, each in a process of its own (``make fuzz``).

An input is a kind, a seed and a number: the same three give the same bytes. What was once wrong stays in ``corpus/``,
which is tried first.
"""

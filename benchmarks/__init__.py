# SPDX-License-Identifier: MIT
"""Benchmarks: how fast and how exact the estimator is, next to a Theseus variant of the same problem.

Run as ``python -m benchmarks``. This file imports nothing: parts of the package run in Theseus' own environment.
"""

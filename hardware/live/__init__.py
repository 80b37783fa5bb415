# SPDX-License-Identifier: MIT
"""The live loop: one thread a device, the estimator, and a recording of all they say."""

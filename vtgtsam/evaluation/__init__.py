# SPDX-License-Identifier: MIT
"""Evaluate methods on recorded sequences: estimates first, then errors, tables and tests from them.

``run`` is the flow; ``sequence`` does one recording with all methods; ``tables`` makes summary and tests
from the stored errors alone, and ``figures`` and ``report`` what people look at, so that they can be made
again without estimating anything.
"""

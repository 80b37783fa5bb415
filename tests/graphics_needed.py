# SPDX-License-Identifier: MIT
"""For tests that draw with OpenGL, which a machine need not have."""

import pytest

from sim.graphics import NoGraphics, check_graphics


def _reason() -> str:
    try:
        check_graphics()
    except NoGraphics as error:
        return str(error)
    return ""


needs_graphics = pytest.mark.skipif(bool(_reason()), reason=_reason() or "there is OpenGL")

# SPDX-License-Identifier: MIT
"""Pictures and films of a recorded sequence, from the recording alone.

From the camera and from the side, pads in contact lit up. The object is drawn where it truly was, or where
the truth is not known, where the visual tracker has it; the hand as its measured joint angles say.
"""

from .film import write_film as write_film
from .sheet import write_sheet as write_sheet

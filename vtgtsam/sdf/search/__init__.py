# SPDX-License-Identifier: MIT
"""The closest point of each pad to the object, found exactly, with less looking where poses follow each other."""

from .closest_points import ClosestPoints as ClosestPoints
from .closest_points import PadContacts as PadContacts
from .tabled import ALWAYS as ALWAYS
from .tabled import IF_INSIDE as IF_INSIDE
from .tabled import NOT as NOT
from .tabled import closest_on_pads as closest_on_pads
from .tabled import new_search as new_search

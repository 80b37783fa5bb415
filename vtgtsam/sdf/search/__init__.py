# SPDX-License-Identifier: MIT
r"""The search for each pad's closest point: exactly the plain search's answer, with less looking.

The plain search takes the distance of every grid point of every pad, in double precision, at every pose. Here

- each pad's points are cut into tiles of neighbours (``tiles``), and each tile has a lower bound of its distances. A
  bound stays good for later poses, less the motion bound: when the pad has moved, no point of it has come closer by
  more than L x (the most that a point of it moved), L being the field's Lipschitz constant (``pad_pose``). Steps shrink
  quickly as an optimiser converges, and so does the set of tiles worth a look;
- where too many are left, all tiles are bounded anew by linear lower bounds of the field (``linear_bounds``): most end
  there, even at a pose unlike any before;
- the tiles left are looked at in single precision, the least lower bound first, until no bound is below the best
  distance (``single_precision``);
- only points within that rounding of the best are evaluated in double precision (``compiled_search``);
- a pad whose distance is not needed matters only where phi < 0: there the best so far is 0 from the start;
- a pad so far away that single precision says nothing is evaluated in double precision, point by point, and one that
  has jumped begins with no bounds: a frame of nonsense leaves nothing behind.

Every bound includes the rounding of single precision, so no shortcut changes a result.
"""

from .closest_points import ClosestPoints as ClosestPoints
from .closest_points import PadContacts as PadContacts

# SPDX-License-Identifier: MIT
"""What rays from one point meet first in a MuJoCo scene: the results of ``mj_multiRay`` in a fifth of its time.

solids.py   where a ray meets a sphere, capsule, cylinder or box, and the normal there
triangle.py the same for a triangle
loops.py    each geom looked for only by the rays that pass its outline
caster.py   what Python calls
"""

from .caster import RayCaster as RayCaster
from .caster import RayGrid as RayGrid

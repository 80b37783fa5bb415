# SPDX-License-Identifier: MIT
"""What rays from one point meet first in a MuJoCo scene: ``mj_ray`` of each, for a whole image.

MuJoCo's own ``mj_multiRay`` takes five to seven times as long, and some pixels in a thousand miss what they should
meet: it first asks whether a ray passes a ball around the body, whose middle it does not turn with the body (3.17).

solids.py   where a ray meets a sphere, capsule, cylinder or box, and the normal there
loops.py    the same for a mesh; each geom is looked for only by the rays that pass its outline
vectors.py  three numbers
caster.py   what Python calls
"""

from .caster import RayCaster as RayCaster
from .caster import RayGrid as RayGrid

"""
Contact planning on a disc
==========================

Three fingers are placed on an elliptic disc. Each is searched on its own third of the rim.
"""

import numpy as np

import graspforce as gf

rim = gf.surfaces.ellipse(0.12, 0.08)
found = gf.plan(
    gf.surfaces.contacts_on(rim, rim, rim),
    initial=[0.2, 2.4, 4.6],
    step=0.4,
    tolerance=0.01,
    bounds=[(0, 2.0), (2.1, 4.1), (4.2, 6.2)],
    friction=0.3,
    max_normal_force=10.0,
    length_scale=0.1,
)
print(found)

picture = found.plot(outline=rim.point(np.linspace(0, 2 * np.pi, 200)))
picture.set_label("Left: the quality over the iterations. Right: three fingers on an elliptic disc")
picture

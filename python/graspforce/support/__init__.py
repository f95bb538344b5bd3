"""Where a body may stand: support regions of its centre of mass, and rectangular feet.

- `support_region`: the region; `patch`: a foot as its four corners.
"""

from .patch import patch
from .support_region import SupportRegion, support_region

__all__ = ["SupportRegion", "patch", "support_region"]

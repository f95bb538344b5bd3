"""Where a body may stand: support regions of its centre of mass, and rectangular feet."""

from .patch import patch
from .support_region import SupportRegion, support_region

__all__ = ["SupportRegion", "patch", "support_region"]

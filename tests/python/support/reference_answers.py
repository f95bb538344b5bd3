"""The grasps of spatial.json with answers by Qhull and HiGHS."""

import json
from pathlib import Path
from typing import Any

REFERENCE = Path(__file__).parents[2] / "reference"

SPATIAL: list[dict[str, Any]] = json.loads((REFERENCE / "spatial.json").read_text())

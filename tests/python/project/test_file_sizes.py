"""A file holds one idea: none has more than 400 lines."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
MOST_LINES = 400


@pytest.mark.parametrize("folder", ["rust", "python", "tests", "benches", "examples", "fuzz", "tools"])
def test_no_source_file_is_longer_than_one_idea(folder):
    # The stub of the extension module is no program, and must be one file.
    found = [path for kind in ("*.rs", "*.py") for path in (ROOT / folder).rglob(kind)]
    sources = [path for path in found if "target" not in path.parts and "corpus" not in path.parts]
    assert sources or folder in ("tools", "fuzz"), folder
    long = {path.name: lines for path in sources if (lines := path.read_text().count("\n")) > MOST_LINES}
    assert not long

"""The viewer that the tests of this folder attack."""

import pytest


@pytest.fixture(scope="module")
def viewer():
    from support.viewer_client import served  # noqa: PLC0415 - viser may be missing

    with served() as viewer:
        yield viewer

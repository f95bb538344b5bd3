"""Arguments nobody means, for property tests: any shape, dtype, stride and value.

HOSTILE_EXAMPLES sets how many each entry point is given.
"""

import os

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

HOSTILE = settings(
    max_examples=int(os.environ.get("HOSTILE_EXAMPLES", "60")),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    print_blob=True,
    derandomize="HOSTILE_EXAMPLES" not in os.environ,  # the same inputs every time, unless one looks for more
)

EXTREMES = [0.0, -0.0, 1.0, -1.0, 5e-324, 1e-160, 1e-30, 1e30, 1e160, 1.7e308, np.inf, -np.inf, np.nan]
NUMBERS = st.one_of(
    st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]), st.floats(-2, 2), st.sampled_from(EXTREMES), st.floats()
)


class Unwilling:
    """Refuses to be an array."""

    def __array__(self, *_args, **_options):
        raise RuntimeError("no array today")


def disguises(array):
    """Dress the same numbers in other clothes."""
    with np.errstate(all="ignore"):
        return st.sampled_from(
            [
                array,
                array.tolist(),
                array.astype(np.float32),
                array.astype(np.float16),
                array.astype(np.longdouble),
                array.astype(">f8"),
                np.asfortranarray(array),
                np.repeat(array, 2, axis=-1)[..., ::2] if array.ndim else array,
                array[::-1][::-1] if array.ndim else array,
                frozen(array),
                array.view(type("Sub", (np.ndarray,), {})),
                np.ma.masked_array(array),
                np.lib.stride_tricks.as_strided(array, writeable=False),
            ]
        )


def frozen(array):
    """Return a read-only copy."""
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def mistakes(array):
    """Values that are no array of real numbers of this shape."""
    return st.sampled_from(
        [
            None,
            "text",
            b"bytes",
            array > 0,
            array + 1j,
            array.astype(object),
            array.astype("U8"),
            np.zeros(array.shape, dtype=[("x", float), ("y", float)]),
            np.ma.masked_array(array, mask=True),
            np.full((*array.shape, 1), 0.5),
            np.zeros((0, *array.shape)),
            np.zeros((*array.shape[:-1], 0)),
            np.broadcast_to(0.5, (2**34, *array.shape)),
            np.broadcast_to(0.5, (2**20, 2**20)),
            [[1.0], [1.0, 2.0]],
            {1: 2},
            Unwilling(),
            np.array(0.5),
            float("nan"),
            10**400,
            np.array(["2020-01-01"], dtype="M8[D]"),
        ]
    )


@st.composite
def arrays(draw, *shape):
    """Mostly of the right shape; sometimes anything."""
    array = draw(hnp.arrays(np.float64, shape, elements=NUMBERS))
    if draw(st.integers(0, 9)) == 0:
        return draw(mistakes(array))
    return draw(disguises(array))


def scalars():
    """One number, or what should have been one."""
    return st.one_of(
        NUMBERS, st.sampled_from([None, "1", True, 2**70, -(2**70), 1j, [], [0.5], np.float32(0.5)])
    )


def counts():
    """Draw a whole number, or what should have been one."""
    return st.one_of(
        st.integers(-1, 12),
        st.sampled_from([None, 2**40, 2**70, -1, 3.0, "8", True, np.int8(4), [3, 4], 65_536]),
    )


def words(*known):
    """One of the known words, or another."""
    return st.sampled_from([*known, *known, "", "MAX", "\0", None, 3])

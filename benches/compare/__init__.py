"""Other software on the same problems: ``make compare``, or ``python -m benches.compare``.

One run times every call on the same seeded problems, block by block in turn, checks that the answers agree,
and prints tables; ``--write`` also puts them into ``docs/measured.md`` and the README.
"""

import os

# Latency of one thread, for everybody: set before NumPy or a peer starts its pool.
for _pool in ("OMP", "OPENBLAS", "MKL", "RAYON"):
    os.environ[f"{_pool}_NUM_THREADS"] = "1"

"""Other software on the same problems: ``make compare``, or ``python -m benches.compare``.

One run times every call on the same seeded problems, block by block in turn, checks that the answers agree,
and prints tables; ``--write`` also puts them into ``docs/measured.md`` and the README.
"""

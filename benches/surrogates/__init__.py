"""What surrogates of quality say of grasps, and what they cost: ``python -m benches.surrogates``."""

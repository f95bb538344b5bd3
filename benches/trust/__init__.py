"""Answers beside independent ones, family by family: ``python -m benches.trust``."""

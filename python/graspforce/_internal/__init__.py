"""Helpers that several packages share.

- `checks`: arguments; `restored`: fields of pickles; `safe_read`: files of limited size;
  `optional_imports`: packages of an extra.
- `to_dict`, `html`: results as dictionaries and as tables of notebooks; `printable`: text that is safe to
  print.
- `differentiable`: what PyTorch and JAX call.
- `vectors`: unit vectors, read-only arrays; `normal_limits`: the largest normal forces, for pictures.
"""

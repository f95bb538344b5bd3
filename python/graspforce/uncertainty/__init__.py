"""What uncertain contacts mean for a grasp: the least friction it needs, and how likely it closes.

- `least_friction`: a bracket; `closure_probability`: from samples, with the interval of `clopper_pearson`.
"""

from .closure_probability import ClosureProbability, probability_of_closure
from .least_friction import FrictionBracket, least_friction

__all__ = ["ClosureProbability", "FrictionBracket", "least_friction", "probability_of_closure"]

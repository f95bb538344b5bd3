"""One line of the table of docs/trust.md."""

from dataclasses import dataclass

__all__ = ["Row"]


@dataclass(frozen=True, slots=True)
class Row:
    """How many cases of a family have an answer, and how many answers are right.

    Attributes
    ----------
    family : str
        What the cases have in common.
    cases : int
        How many there are.
    oracle : str
        What the answers are compared with.
    missed : int
        Cases without an answer that have one.
    wrong : int
        Answers that the oracle contradicts.
    """

    family: str
    cases: int
    oracle: str
    missed: int
    wrong: int

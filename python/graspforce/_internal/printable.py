"""Text from files, such as names, made safe to print: a terminal obeys control characters."""

from __future__ import annotations


def printable(text: str, keep: str = "") -> str:
    r"""Replace what is no visible character (control codes, changes of writing direction) by its escape.

    Examples
    --------
    >>> from graspforce._internal.printable import printable
    >>> printable("cup\x1b[2J")
    'cup\\x1b[2J'
    """
    shown = (c if c.isprintable() or c in keep else c.encode("unicode_escape").decode() for c in text)
    return text if text.isprintable() else "".join(shown)

"""Pages of the reference: what a class page lists, and the attributes of a class as a table."""

import inspect
import re
from importlib import import_module
from textwrap import dedent

SECTION = re.compile(r"^Attributes\n-+\n((?:.*\n?)*?)(?=^\S[^\n]*\n-+\n|\Z)", re.MULTILINE)
ENTRY = re.compile(r"^(\S[^:\n]*?)(?: : (.*))?\n((?:(?:[ \t].*)?\n)*)", re.MULTILINE)


def attributes_of(docstring):
    """Return names, type and description of every entry of the section ``Attributes``."""
    section = SECTION.search(inspect.cleandoc(docstring or "") + "\n")
    if section is None:
        return []
    return [(names, kind, dedent(text).strip()) for names, kind, text in ENTRY.findall(section[1] + "\n")]


def members_of(module, name):
    """Return the public members of a class that its table of attributes does not describe.

    An attribute with a longer docstring of its own has both.
    """
    value = import_module(module)
    for part in name.split("."):
        value = getattr(value, part)
    described = {each.strip() for names, _, _ in attributes_of(value.__doc__) for each in names.split(",")}
    own = [base for base in reversed(value.__mro__) if base.__module__.startswith("graspforce")]
    shown = []
    for key, member in {key: member for base in own for key, member in vars(base).items()}.items():
        text = getattr(member, "__doc__", None) or getattr(getattr(member, "__func__", None), "__doc__", None)
        if (
            key.startswith("_")
            or not text
            or not (inspect.isroutine(member) or inspect.isdatadescriptor(member))
        ):
            continue
        if key in described and "\n\n" not in inspect.cleandoc(text):
            continue
        shown.append(key)
    return sorted(shown, key=lambda key: (not callable(getattr(value, key)), key))


def tabulate_attributes(_app, kind, _name, _value, _options, lines):
    """Turn the entries of the section ``Attributes`` of a class into a table."""
    docstring = "\n".join(lines)
    entries = attributes_of(docstring)
    if kind not in {"class", "exception"} or not entries:
        return
    table = ["Attributes", "----------", ".. list-table::", "   :class: attributes", "   :widths: 1 3", ""]
    for names, type_, text in entries:
        named = ", ".join(f"``{each.strip()}``" for each in names.split(","))
        described = text.splitlines() or [""]
        table += [f"   * - {named}", "", f"       {type_}" if type_ else "", ""]
        table += [f"     - {described[0]}", *(f"       {line}".rstrip() for line in described[1:]), ""]
    before, after = SECTION.split(inspect.cleandoc(docstring) + "\n")[::2]
    lines[:] = [*before.splitlines(), *table, "", *after.splitlines()]


def setup(app):
    """Register the table of attributes before napoleon reads the docstring."""
    app.connect("autodoc-process-docstring", tabulate_attributes, priority=400)
    app.config.autosummary_context = {"members_of": members_of}
    return {"parallel_read_safe": True}

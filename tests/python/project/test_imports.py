"""No modules need each other, over however many others, in Python or in Rust."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

# A grasp makes its quality, and a quality hands its grasp back.
ALLOWED = {"core": [], "py": [{"grasp", "quality"}]}


def circles(graph):
    """Return the sets of modules that need each other (Tarjan's strongly connected components)."""
    order, low, stack, found = {}, {}, [], []

    def visit(node):
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in graph[node]:
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            part = set(stack[stack.index(node) :])
            del stack[stack.index(node) :]
            if len(part) > 1:
                found.append(part)

    for node in graph:
        if node not in order:
            visit(node)
    return found


def uses(base):
    """Return, for every Rust module below `rust/base`, the modules that its code names by `crate::`."""
    folder = ROOT / "rust" / base
    modules = {}
    for file in sorted(folder.rglob("*.rs")):
        parts = file.relative_to(folder).with_suffix("").parts
        name = "::".join(parts[:-1] if parts[-1] == "mod" else parts)
        lines = file.read_text().split("#[cfg(test)]")[0].splitlines()
        modules[name] = "\n".join(line for line in lines if not line.lstrip().startswith("//"))
    graph = {}
    for name, code in modules.items():
        paths = [path.split("::") for path in re.findall(r"\bcrate::([a-z_][\w:]*)", code)]
        prefixes = [["::".join(path[:n]) for n in range(len(path), 0, -1)] for path in paths]
        used = {next((one for one in names if one in modules), name) for names in prefixes}
        graph[name] = used - {name}
    return graph


def test_circles_of_two_and_of_three_are_found():
    graph = {"a": {"b"}, "b": {"a", "c"}, "c": {"d"}, "d": {"e"}, "e": {"c"}, "f": {"a"}}
    assert sorted(circles(graph), key=len) == [{"a", "b"}, {"c", "d", "e"}]


@pytest.mark.parametrize("base", ["core", "py"])
def test_no_rust_modules_need_each_other_but_the_named_ones(base):
    assert circles(uses(base)) == ALLOWED[base]


def test_no_python_modules_need_each_other_not_even_for_annotations():
    grimp = pytest.importorskip("grimp", reason="grimp is not installed: pip install --group test")
    imports = grimp.build_graph("graspforce")
    assert len(imports.modules) > 100
    assert not circles({name: imports.find_modules_directly_imported_by(name) for name in imports.modules})


def test_the_core_of_the_package_imports_no_room_above_it():
    grimp = pytest.importorskip("grimp", reason="grimp is not installed: pip install --group test")
    imports = grimp.build_graph("graspforce")
    floors = [
        {"graspforce.cli"},
        {"graspforce.viewer", "graspforce.paper"},
        {"graspforce.hands"},
        {"graspforce.plotting", "graspforce.files", "graspforce.datasets", "graspforce.adapters"},
        {"graspforce.planning"},
        {"graspforce.surfaces"},
        {"graspforce._internal"},
    ]
    layers = tuple(grimp.Layer(*floor, independent=True) for floor in floors)
    assert not imports.find_illegal_dependencies_for_layers(layers)

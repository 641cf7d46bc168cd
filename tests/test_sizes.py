"""Files and functions fit into a head, and a class name means one thing."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
from statistics import median

PACKAGE = Path(__file__).parents[1] / "ikns"
#: Lines of a function without its docstring, of a file, and of the file in the middle.
LONGEST_BODY, LONGEST_FILE, MIDDLE_FILE = 80, 500, 140


@cache
def trees() -> dict[Path, ast.Module]:
    return {
        path: ast.parse(path.read_text(encoding="utf-8"))
        for path in PACKAGE.rglob("*.py")
    }


def test_a_function_fits_on_a_page() -> None:
    kinds = ast.FunctionDef, ast.AsyncFunctionDef
    long = []
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, kinds):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                if lines > LONGEST_BODY:
                    long.append(f"{path.name}: {node.name} has {lines} lines")
    assert not long


def test_files_are_small() -> None:
    lines = [len(path.read_text(encoding="utf-8").splitlines()) for path in trees()]
    assert max(lines) <= LONGEST_FILE
    assert median(lines) <= MIDDLE_FILE


def test_a_class_name_stands_once() -> None:
    names = Counter(
        node.name
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    )
    assert names
    assert not [name for name, times in names.items() if times > 1]

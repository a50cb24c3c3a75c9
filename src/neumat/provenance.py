"""Digests of code: what a stage's result depends on beside its input files and its config keys."""

import ast
import functools
import hashlib
from pathlib import Path

ROOT = Path(__file__).parent


def digest(path):
    """Return a short digest of the Python file `path` and of every neumat module that it imports, transitively.

    Comments, docstrings and layout don't count. A file in the folder `data` beside a module that names it in a
    string counts with its bytes.
    """
    found, waiting = {}, [Path(path)]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file], imported = read(file)
            waiting.extend(imported)
    return hashlib.sha256("".join(sorted(found.values())).encode()).hexdigest()[:16]


@functools.cache
def read(file):
    """Return (digest of one file's code and data, the neumat files that it imports)."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    stored = {path.name: path for path in (file.parent / "data").glob("*")}
    data, imported = b"", set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            if ast.get_docstring(node, clean=False) is not None:
                del node.body[0]
        elif isinstance(node, ast.Import):
            imported.update(*(_files(alias.name) for alias in node.names))
        elif isinstance(node, ast.ImportFrom):
            imported.update(*(_files(f"{node.module}.{alias.name}") for alias in node.names))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = node.value.removeprefix("data/")
            data += stored[name].read_bytes() if name in stored else b""
    return hashlib.sha256(ast.dump(tree).encode() + data).hexdigest(), imported


def _files(name):
    """Return the files that importing the dotted `name` runs, those of neumat only; its last part may be no module."""
    first, *parts = name.split(".")
    if first != ROOT.name:
        return set()
    candidates = [ROOT / "__init__.py"]
    for k in range(1, len(parts) + 1):
        module = ROOT.joinpath(*parts[:k])
        candidates += [module / "__init__.py", module.with_suffix(".py")]
    return {file for file in candidates if file.is_file()}

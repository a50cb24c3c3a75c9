"""Digests of code: what they see and what they don't."""

import pytest

from neumat import provenance

MODULE = """
def double(x):
    return 2 * x
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A package `neumat` of its own: script.py imports neumat.a.one, which imports neumat.b inside a function."""
    package = tmp_path / "neumat"
    for path, text in {
        "script.py": "from neumat.a import one\nprint(one.quadruple(1))\n",
        "neumat/__init__.py": "",
        "neumat/a/__init__.py": "",
        "neumat/a/one.py": "def quadruple(x):\n    from neumat.b import double\n    return double(double(x))\n",
        "neumat/a/data/table.csv": "1,2",
        "neumat/b.py": MODULE + 'DATA = "data/numbers.csv"\n',
        "neumat/data/numbers.csv": "3,4",
        "neumat/unused.py": "X = 1\n",
    }.items():
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.setattr(provenance, "ROOT", package)
    return tmp_path


def changes(project, path, text):
    """Whether the digest of script.py changes when `path` gets another `text`."""
    provenance.read.cache_clear()
    before = provenance.digest(project / "script.py")
    (project / path).write_text(text)
    provenance.read.cache_clear()
    return provenance.digest(project / "script.py") != before


def test_comments_docstrings_and_layout_do_not_count(project):
    documented = (
        '"""New docstring."""\n\n# A comment.\ndef double(x):\n    """Twice."""\n    return (2\n        * x)  # twice\n'
    )
    assert not changes(project, "neumat/b.py", documented + 'DATA = "data/numbers.csv"\n')


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("script.py", "from neumat.a import one\nprint(one.quadruple(2))\n"),
        ("neumat/a/one.py", "def quadruple(x):\n    from neumat.b import double\n    return double(double(+x))\n"),
        ("neumat/b.py", MODULE.replace("2", "3") + 'DATA = "data/numbers.csv"\n'),
        ("neumat/a/__init__.py", "X = 1\n"),
        ("neumat/data/numbers.csv", "3,5"),
    ],
)
def test_code_and_data_that_the_script_uses_count(project, path, text):
    assert changes(project, path, text)


@pytest.mark.parametrize("path", ["neumat/unused.py", "neumat/a/data/table.csv"])
def test_what_the_script_does_not_use_does_not_count(project, path):
    assert not changes(project, path, "Y = 2\n")

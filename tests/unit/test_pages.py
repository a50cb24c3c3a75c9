"""The README and the pages of docs/: short, linked, and with small pictures."""

import re
from pathlib import Path

import pytest

from neumat.reporting.docs import BYTES, END, START, TOTAL_BYTES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "results/README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_readme_fits_200_lines():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 200


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_of_the_repository(page):
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text())
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


def test_files_of_docs_are_small():
    files = [path for path in (ROOT / "docs").iterdir() if path.suffix != ".md"]
    assert {path.suffix for path in files} <= {".webp"}
    assert all(path.stat().st_size <= BYTES for path in files)
    assert sum(path.stat().st_size for path in files) <= TOTAL_BYTES


def test_every_picture_of_docs_is_shown():
    shown = "".join(page.read_text() for page in PAGES)
    assert [path.name for path in (ROOT / "docs").glob("*.webp") if path.name not in shown] == []


def test_the_readme_has_the_markers_of_its_headline():
    text = (ROOT / "README.md").read_text()
    assert 0 < text.find(START) < text.find(END)

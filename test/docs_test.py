"""README and docs: each link to a file or a heading of the repository leads somewhere."""
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")


def anchors(page):
    """The anchors that GitHub gives the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for path, anchor in LINK.findall(page.read_text()):
        target = page.parent / path if path else page
        assert target.exists(), f"{page.name}: no file {path}"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: no heading #{anchor} in {target.name}"


def test_the_contents_of_the_method_name_every_section():
    page = ROOT / "docs" / "method.md"
    contents = page.read_text().split("## Limits of the model")[0]
    for anchor in anchors(page)[1:]:
        assert f"(#{anchor})" in contents, anchor


def test_no_two_equations_of_the_method_have_one_number():
    numbers = re.findall(r"\\tag\{([^}]+)\}", (ROOT / "docs" / "method.md").read_text())
    assert len(numbers) > 50
    assert sorted(set(numbers)) == sorted(numbers)

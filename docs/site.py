"""Hooks of MkDocs: turn what the pages say to GitHub and to the tests into the form of the site.

A link to a file outside of docs/ becomes the path of that file in the repository. A fence keeps only the language, of
`yaml task` the word `yaml`; the second word is for `tests/project/test_docs.py`. A picture of the gallery becomes a
link to the page that `python -m docs.gallery` has made.
"""

from __future__ import annotations

import posixpath
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

LINK = re.compile(r"\[(?P<text>[^\]]*)\]\((?P<target>(?:\.\./)+[^)\s]*)\)")

FENCE = re.compile(r"^```(?P<language>\w+) \w+$", re.MULTILINE)

THUMBNAIL = re.compile(r"!\[[^\]]*\]\(images/gallery/(?P<name>\w+)\.webp\)")


def on_page_markdown(markdown: str, *, page: Page, **_: Any) -> str:
    """Return a page in the form of the site."""
    folder = posixpath.dirname(page.file.src_uri)

    def inside_or_path(link: re.Match[str]) -> str:
        place = posixpath.normpath(posixpath.join("docs", folder, link["target"]))
        return link[0] if place.startswith("docs/") else f"{link['text']} (`{place}`)"

    inside = FENCE.sub(r"```\g<language>", LINK.sub(inside_or_path, markdown))
    return THUMBNAIL.sub(r"[\g<0>](gallery/\g<name>.html)", inside)

"""The folder that Sphinx reads: pages of the repository, generated pages, and the files that they link to.

Pages keep their links as GitHub shows them; here each link is turned to where its target is on the site. A page of the
repository has a place on the site (`place_of`); a picture is copied; any other file gets a page that shows its text, so
that no link depends on where the repository is published.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from conf import GITHUB, REPOSITORY, UNPUBLISHED

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
RESULTS = ROOT / "results"
SHOWN = RESULTS / "reference"
"""The results whose numbers the tables show."""
HAND_WRITTEN = DOCS / "site" / "pages"

CODE = re.compile(r"^(?P<fence>`{3,}).*?^(?P=fence) *$", re.MULTILINE | re.DOTALL)
"""A block of code, whose text stays as it is."""
LINK = re.compile(r"(?P<picture>!?)\[(?P<text>(?:!\[[^\]]*\]\([^)]*\)|[^\[\]])*)\]\((?P<target>[^)\s]+)\)")
HEADING = re.compile(r"^#\s+(.+)$", re.MULTILINE)
PICTURES = (".png", ".gif", ".svg", ".jpg")
LANGUAGES = {".py": "python", ".json": "json", ".cfg": "ini", ".toml": "toml", ".cff": "yaml", ".yml": "yaml"}
MOST_BYTES = 300_000
"""Longer files are shown up to here."""

FIXED = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "docs/index.md": "handbook.md",
    "results/README.md": "results/index.md",
    "results/TUNING.md": "results/tuning.md",
}
"""Pages whose place on the site does not follow from their folder. The start page stands for README."""


def place_of(path: str) -> str | None:
    """Return where a file of the repository is on the site, both relative to their roots; None: it is not a page."""
    if path in FIXED:
        return FIXED[path]
    file = Path(path)
    if file.parts[0] == "results" and len(file.parts) == 3 and file.name == "README.md":
        return f"results/{file.parts[1]}.md"
    if path.startswith("docs/site/pages/") and file.suffix == ".md":
        return path.removeprefix("docs/site/pages/")
    if path.startswith("docs/notebooks/") and file.suffix == ".ipynb":
        return path.removeprefix("docs/")
    if file.parts[0] == "docs" and file.suffix == ".md" and file.parts[1] != "site" and "notes" not in file.parts:
        return path.removeprefix("docs/")
    return None


def pages() -> Iterator[str]:
    """Yield every file of the repository that is a page of the site, except those that another page stands for."""
    for folder, ending in (("docs", "*.md"), ("docs", "*.ipynb"), ("results", "*.md")):
        for path in sorted((ROOT / folder).rglob(ending)):
            name = path.relative_to(ROOT).as_posix()
            if place_of(name) is not None and ".ipynb_checkpoints" not in name:
                yield name
    yield from ("CONTRIBUTING.md", "CHANGELOG.md")


class Site:
    """The folder that Sphinx reads, as it grows."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.shown: set[str] = set()
        """Files of the repository that a page shows or that were copied."""

    def add(self, place: str, text: str, origin: str) -> None:
        """Write a page; its links lead from `origin`, a file of the repository."""
        self.write(place, self.with_links(text, origin, place))

    def write(self, place: str, text: str) -> None:
        """Write a page as it is."""
        path = self.out / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def with_links(self, text: str, origin: str, place: str) -> str:
        """Return a text whose links, which lead from the file `origin`, lead from the site's page `place`."""
        parts, end = [], 0
        for code in CODE.finditer(text):
            parts += [self._turned(text[end : code.start()], origin, place), code[0]]
            end = code.end()
        return "".join([*parts, self._turned(text[end:], origin, place)])

    def notebook(self, text: str, origin: str, place: str) -> str:
        """Return a notebook with its links turned, and with the address under which the project is published."""
        content = json.loads(text.replace(UNPUBLISHED, REPOSITORY.removeprefix(GITHUB)))
        for cell in content["cells"]:
            if cell["cell_type"] == "markdown":
                cell["source"] = self.with_links("".join(cell["source"]), origin, place)
        return json.dumps(content)

    def _turned(self, text: str, origin: str, place: str) -> str:
        def turn(found: re.Match[str]) -> str:
            inner = LINK.sub(turn, found["text"])  # a picture that is a link
            return f"{found['picture']}[{inner}]({self.link(found['target'], origin, place)})"

        return LINK.sub(turn, text)

    def link(self, target: str, origin: str, place: str) -> str:
        """Return a link's target as seen from the page `place`; whatever it names is made part of the site.

        Targets are relative to `origin`, as on GitHub; one that begins with a slash is a place on the site.

        Raises:
            FileNotFoundError: it names nothing in the repository.
        """
        if "://" in target or target.startswith(("#", "mailto:")):
            return target
        if target.startswith("/"):
            return relative(target[1:], place)
        file, _, anchor = target.partition("#")
        path = (ROOT / origin).parent.joinpath(file).resolve()
        if not path.exists():
            raise FileNotFoundError(f"{origin} links to {target}, which does not exist")
        name = path.relative_to(ROOT).as_posix()
        there = place_of(name) or (self._copied(name) if path.suffix in PICTURES else self._source_page(name))
        return relative(there, place) + (f"#{anchor}" if anchor and place_of(name) else "")

    def _copied(self, name: str) -> str:
        place = f"files/{name}"
        if name not in self.shown:
            self.shown.add(name)
            (self.out / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, self.out / place)
        return place

    def _source_page(self, name: str) -> str:
        place = f"source/{name}.md"
        if name not in self.shown:
            self.shown.add(name)
            path = ROOT / name
            self.write(place, _listing(path, name) if path.is_dir() else _source(path, name))
        return place


def relative(target: str, place: str) -> str:
    """Return the path from the page `place` to `target`, both relative to the site's root."""
    up = len(Path(place).parts) - 1
    return "../" * up + target if up else target


def _source(path: Path, name: str) -> str:
    text = path.read_text(encoding="utf-8", errors="replace")
    cut = "\n\nThe first part of the file.\n" if len(text) > MOST_BYTES else "\n"
    fence = "`" * 6
    body = text[:MOST_BYTES].rstrip("\n")
    return (
        f"---\norphan: true\nnosearch: true\n---\n\n# {name}\n\nA file of the repository.{cut}\n"
        f"{fence}{{code-block}} {LANGUAGES.get(path.suffix, 'text')}\n:force:\n\n{body}\n{fence}\n"
    )


def _listing(path: Path, name: str) -> str:
    """Return a page with the files of a folder that git keeps."""
    files = sorted(file.relative_to(path).as_posix() for file in path.rglob("*") if file.is_file())
    lines = "\n".join(f"- `{file}`" for file in files if "__pycache__" not in file)
    return f"---\norphan: true\nnosearch: true\n---\n\n# {name}/\n\nA folder of the repository.\n\n{lines}\n"


def title_of(name: str) -> str:
    """Return the heading of a page of the repository."""
    found = HEADING.search((ROOT / name).read_text(encoding="utf-8"))
    return found[1] if found else Path(name).stem

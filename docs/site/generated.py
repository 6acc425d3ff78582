"""The pages and parts of pages that are made from the registry, the shipped results and the code.

Everything here follows what is registered and what lies in the results folders: a new task, method or study appears on
the site without a change.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from assemble import RESULTS, ROOT, Site
from code_pages import api
from code_text import definition
from codesign_bench.registry import built_in
from codesign_bench.study import load_study
from fragments import toctree
from member_pages import methods, success, tasks
from motion_pages import copy_gallery, gallery, in_motion, tasks_in_motion
from study_pages import studies, study_page

EXPLORED = RESULTS / "all_methods"
"""What the explorer shows: policies on the present version of every task."""
EXPLORER = "explore.html"
"""Where the explorer lies on the site."""
INSERT = re.compile(r"^<!-- insert: (\w+) -->$", re.MULTILINE)
"""Where a hand-written page takes a generated part."""
CODE = re.compile(r"^<!-- code: (\S+) (\w+) -->$", re.MULTILINE)
"""Where it takes the lines of a file that define a name."""


def completed(name: str, text: str) -> str:
    """Return a page of the repository with its generated parts, and with the tables of contents that the site needs."""
    text = INSERT.sub(lambda found: in_links_of(name, INSERTS[found[1]]()), text)
    if name.startswith("docs/tasks/"):
        text = text.replace("\n## ", f"\n{in_motion(Path(name).stem)}\n## ", 1)
    text = CODE.sub(lambda found: f"```python\n{definition(ROOT / found[1], found[2])}\n```", text)
    return text + toctree(CHILDREN[name]()) if name in CHILDREN else text


def write(site: Site) -> None:
    """Write every generated page."""
    copy_gallery(site)
    for place, text in [
        ("gallery.md", gallery()),
        ("tasks/index.md", tasks()),
        ("methods/index.md", methods()),
        ("studies/index.md", studies()),
        *((f"studies/{name}.md", study_page(load_study(name))) for name in built_in("studies")),
    ]:
        site.add(place, text, "README.md")
    for place, text in api():
        site.write(place, text)


def in_links_of(name: str, text: str) -> str:
    """Return a generated part, whose links lead from the repository's root, for a page in a folder below it."""
    up = "../" * (len(Path(name).parts) - 1)
    return re.sub(r"\]\((?=\w[^)]*\))(?!\w+:)", f"]({up}", text)


def _handbook() -> list[str]:
    """Return the pages directly under docs/, in the order in which the index names them, then the others."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\((\w+)\.md\)", index)
    others = sorted(path.stem for path in (ROOT / "docs").glob("*.md") if path.stem != "index")
    return list(dict.fromkeys([*(name for name in named if name in others), *others]))


def _results() -> list[str]:
    folders = sorted(path.parent.name for path in RESULTS.glob("*/README.md"))
    return ["reference", *(name for name in folders if name != "reference"), "tuning"]


CHILDREN: dict[str, Callable[[], list[str]]] = {"docs/index.md": _handbook, "results/README.md": _results}
"""Page of the repository -> the pages below it in the sidebar."""


def explorer() -> str:
    """Return the explorer on shipped results, in a frame of its page and by itself."""
    return (
        "```{raw} html\n"
        f'<iframe class="explorer" src="{EXPLORER}" title="The explorer: drag the goal, see the tool" loading="lazy">'
        "</iframe>\n"
        f'<p><a href="{EXPLORER}">The explorer on a page of its own</a></p>\n'
        "```"
    )


INSERTS: dict[str, Callable[[], str]] = {"tasks": tasks_in_motion, "success": success, "explorer": explorer}
"""Name in `<!-- insert: NAME -->` -> the part."""

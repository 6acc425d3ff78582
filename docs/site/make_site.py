"""Build the site: gather its sources, let Sphinx build them with warnings as errors, add the explorer, check every
internal link.

python docs/site/make_site.py [--links]    into build/site; with --links, also ask for every external link
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

import generated
from assemble import ROOT, Site, pages, place_of
from check_links import faults
from codesign_bench.explorer.gather import Choice
from codesign_bench.explorer.page import write_explorer

SOURCE, OUT = ROOT / "build" / "site-source", ROOT / "build" / "site"
EXPLORED_CELLS = Choice(methods=("gnn_ppo", "shared_arch", "stackelberg_ppo", "cma_rl"))
"""The paper's two that make a tool per goal, the one that is ahead in these results, and one with a single tool."""


def gather(out: Path) -> None:
    """Write all sources of the site into `out`, which is emptied first."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    site = Site(out)
    for name in pages():
        text, place = (ROOT / name).read_text(encoding="utf-8"), place_of(name)
        assert place is not None
        if name.endswith(".ipynb"):
            site.write(place, site.notebook(text, name, place))
        else:
            site.add(place, generated.completed(name, text), name)
    generated.write(site)


def sphinx(builder: str, out: Path) -> int:
    """Run one of Sphinx's builders and return its exit code."""
    # The notebooks call the program that is installed beside this Python.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    options = ["-W", "--keep-going", "-q", "-b", builder, "-c", str(Path(__file__).parent)]
    command = [sys.executable, "-m", "sphinx", *options, str(SOURCE), str(out)]
    return subprocess.run(command, env={**os.environ, "PATH": path}, check=False).returncode


def main() -> int:
    """Build the site and return the exit code."""
    parser = argparse.ArgumentParser(description="Build the site into build/site.")
    parser.add_argument("--links", action="store_true", help="ask for every external link instead; needs a network")
    options = parser.parse_args()
    gather(SOURCE)
    if options.links:
        return sphinx("linkcheck", ROOT / "build" / "site-links")
    shutil.rmtree(OUT, ignore_errors=True)
    if code := sphinx("html", OUT):
        return code
    write_explorer(generated.EXPLORED, OUT / generated.EXPLORER, print, EXPLORED_CELLS)
    found = faults(OUT)
    print("\n".join(found) or f"the site is in {OUT.relative_to(ROOT)}: open {OUT.relative_to(ROOT)}/index.html")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

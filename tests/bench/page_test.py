#!/usr/bin/python3
"""The page of results at tiny size: every bench runs, every section has rows, and every cell says something."""
import argparse
import html.parser
import os
import pathlib
import subprocess
import sys
import tempfile

SECTIONS = 12  # headings: one each, scaling has two


class Tables(html.parser.HTMLParser):
    """Rows of cells by heading."""

    def __init__(self):
        super().__init__()
        self.by_heading, self.inside, self.heading = {}, None, None

    def handle_starttag(self, tag, attributes):
        self.inside = tag
        if tag == "tr" and self.heading:
            self.by_heading[self.heading].append([])

    def handle_endtag(self, tag):
        self.inside = None

    def handle_data(self, data):
        if self.inside == "h2":
            self.heading = data
            self.by_heading[data] = []
        elif self.inside == "td" and self.heading:
            self.by_heading[self.heading][-1].append(data)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.html"
        done = subprocess.run([pathlib.Path(__file__).with_name("run"), "--tiny", "-o", page], capture_output=True, text=True,
                              env={**os.environ, "LIGHTMILL_BUILD": str(arguments.build)}, check=False)
        assert done.returncode == 0, f"exit {done.returncode}:\n{done.stdout}\n{done.stderr}"
        tables = Tables()
        tables.feed(page.read_text())
    assert len(tables.by_heading) == SECTIONS, list(tables.by_heading)
    for heading, rows in tables.by_heading.items():
        rows = [row for row in rows if row]
        # Some sections show shared scenes only, which need not be here.
        assert rows or "left out:" in done.stdout, f"{heading}: no rows"
        for row in rows:
            for cell in row:
                assert cell and "nan" not in cell and "inf" not in cell, f"{heading}: {row}"
    refused = subprocess.run([pathlib.Path(__file__).with_name("run"), "speed"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "no section speed" in refused.stderr, refused.stderr
    print("passed")


if __name__ == "__main__":
    sys.exit(main())

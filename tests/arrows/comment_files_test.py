"""Files that comments and pages name are there.

    comment_files_test.py

A name is right if a tracked file has it as its path or as the end of its path (`film.h`, `film/film.h`). A name that begins
with a folder of the root may also be a folder, or a file without its extension (`tests/bench/queues`).
"""
import ast
import io
import pathlib
import re
import subprocess
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCES = (".cc", ".h", ".ts", ".mjs", ".proto", ".py", ".sh", ".md")
FOLDERS = "common|coordinator|worker|client|tests|deploy|docs|proto|scenes"
# What is neither in the repository nor wrong: files that a build makes, of third parties, of users in examples.
ALLOWED = re.compile(r"""
    (.*/)?\w+(\.grpc)?\.pb\.(h|cc) | (.*/)?source_digest\.h | deploy/out | client/python/generated
  | (OUTPUT|PAGE)\.\w+
  | (.*/)?(embree3|OpenImageIO|openimageio|google|grpcpp|sqlite3|libpq-fe|CLI|nlohmann)(/.*|\.h)
""", re.X)
# Pages about the past.
EXEMPT = {"CHANGELOG.md"}

BEFORE = r"(?<![\w*<{}$%/.:@~-])"
NAME = re.compile(BEFORE + r"(?:\.{1,2}/)*((?:[\w-]+/)*[\w-]+(?:\.[\w-]+)*\.(?:h|cc|py|ts|proto|sh|md|mjs))(?![\w/*]|\.\w)")
PLACE = re.compile(BEFORE + rf"((?:{FOLDERS})/[\w./-]*\w)(?![\w*{{<$])")
# A string or a comment, whichever begins first (1'000 begins none).
C_LIKE = re.compile(r"""R"(\w*)\((?:.|\n)*?\)\1" | "(?:\\.|[^"\\\n])*" | (?<!\w)'(?:\\.|[^'\\\n])*' | `(?:\\.|[^`\\])*`
                        | (//[^\n]*|/\*(?:.|\n)*?\*/)""", re.X)
HASH = re.compile(r'(?:^|(?<=\s))#[^\n]*', re.M)


def comments(path, text):
    """Pairs of a line's number and its words, for what a reader reads as prose."""
    suffix = pathlib.PurePath(path).suffix
    if suffix == ".md":
        spans = [(0, text)]
    elif suffix in (".cc", ".h", ".ts", ".mjs", ".proto"):
        spans = [(m.start(2), m[2]) for m in C_LIKE.finditer(text) if m[2]]
    elif suffix == ".py":
        spans = []
        yield from ((t.start[0], t.string) for t in tokenize.generate_tokens(io.StringIO(text).readline)
                    if t.type == tokenize.COMMENT and not t.string.startswith("#!"))
    else:
        spans = [(m.start(), m[0]) for m in HASH.finditer(text) if not m[0].startswith("#!")]
    for start, span in spans:
        first = text.count("\n", 0, start) + 1
        yield from enumerate(span.split("\n"), first)
    if suffix == ".py":
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)) and ast.get_docstring(node, False):
                yield from enumerate(ast.get_docstring(node, False).split("\n"), node.body[0].lineno)


class Tree:
    """What the names of a set of files may be called."""

    def __init__(self, files):
        self.files, self.places = set(), set()
        for file in files:
            self.files.update(ends(file))
            parts = file.split("/")
            for depth in range(1, len(parts)):
                self.places.update(ends("/".join(parts[:depth])))
            self.places.update(ends(file))
            self.places.update(ends(file.rsplit(".", 1)[0]))

    def wrong(self, line):
        """The names in a line that lead nowhere."""
        line = re.sub(r"\w+://\S*", "", line)
        found = [name for name in NAME.findall(line) if name not in self.files]
        found += [name for name in PLACE.findall(line) if name not in self.places and name not in found]
        return [name for name in found if not ALLOWED.fullmatch(name)]


def ends(path):
    """a/b/c: a/b/c, b/c and c."""
    parts = path.split("/")
    return ["/".join(parts[at:]) for at in range(len(parts))]


def main():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    files = [f for f in listed if f and (ROOT / f).is_file()]
    assert len(files) > 500, "where are the files?"
    tree = Tree(files)
    found = []
    for path in files:
        if path in EXEMPT or path.startswith("tests/fuzz/corpus/"):
            continue
        if path.endswith(SOURCES) or path.endswith("CMakeLists.txt"):
            found += [f"{path}:{number}: no file {name}" for number, line in comments(path, (ROOT / path).read_text())
                      for name in tree.wrong(line)]
    # What it must find, and what it must not.
    small = Tree(["common/film/film.h", "tests/bench/planning/plan_check.cc", "worker/main.cc"])
    planted = """
// See film.h, film/film.h (common/film/film.h); but not filn.h.
int a = 1'000;  // don't: tests/bench/plan_check, tests/bench/planning/plan_check, tests/bench/planning.
const char* s = "// nothing.h";  /* worker/render/, scene.pb.h and *.cc,
   worker/main.cc but worker/mian.cc */
"""
    bad = [(n, name) for n, line in comments("a.cc", planted) for name in small.wrong(line)]
    assert bad == [(2, "filn.h"), (3, "tests/bench/plan_check"), (4, "worker/render"), (5, "worker/mian.cc")], bad
    bad = [(n, name) for n, line in comments("a.py", '"""Reads x.h."""\ny = "# z.h"  # w.h\n') for name in small.wrong(line)]
    assert sorted(bad) == [(1, "x.h"), (2, "w.h")], bad
    print("\n".join(found) or "ok")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

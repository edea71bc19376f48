"""A page of results: text as it comes, and one self-contained HTML file at the end."""
import html
import pathlib
import platform
import subprocess

from bench_common import CORES, LIGHTMILL

STYLE = """<style>:root{color-scheme:light dark;--back:#fff;--text:#20242b;--dim:#5c636e;--rule:#dfe2e7}
@media (prefers-color-scheme:dark){:root{--back:#15181d;--text:#dfe3e9;--dim:#99a1ad;--rule:#2c323b}}
body{background:var(--back);color:var(--text);font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.2rem .7rem .2rem 0;border-bottom:1px solid var(--rule);font-weight:400}
th,figcaption{color:var(--dim)}td{font-variant-numeric:tabular-nums}svg{max-width:100%;height:auto}figure{display:inline-block;margin:.3rem}
figure img{width:150px;image-rendering:pixelated}</style>"""


def machine():
    """What figures depend on: processor, cores, system and build."""
    model = platform.processor()
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    version = subprocess.run([LIGHTMILL, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    return {"processor": model, "cores": CORES, "system": platform.platform(), "build": version}


class Page:
    """Headings, paragraphs and tables, in order. `echo`: also to stdout, tables as Markdown."""

    def __init__(self, title, echo=True):
        self.title, self.echo, self.parts = title, echo, []
        self._say(f"# {title}")

    def _say(self, text):
        if self.echo:
            print(text, flush=True)

    def fragment(self, code):
        """HTML as it is; not part of the text."""
        self.parts.append(code)

    def heading(self, text):
        self._say(f"\n## {text}")
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def paragraph(self, text):
        self._say(text)
        self.parts.append(f"<p>{html.escape(text)}</p>")

    def facts(self, figures):
        self._say("\n".join(f"{name}: {value}" for name, value in figures.items()))
        self.parts.append("<table>" + "".join(f"<tr><th>{html.escape(n)}</th><td>{html.escape(str(v))}</td></tr>"
                                              for n, v in figures.items()) + "</table>")

    def table(self, columns, rows):
        """`rows` may be a generator: each row is printed as it is there."""
        self._say(f"| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")
        code = "<table><tr>" + "".join(f"<th>{html.escape(c)}</th>" for c in columns) + "</tr>"
        for row in rows:
            cells = [str(cell) for cell in row]
            self._say(f"| {' | '.join(cells)} |")
            code += "<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in cells) + "</tr>"
        self.parts.append(code + "</table>")

    def write(self, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{html.escape(self.title)}"
                        f"</title>{STYLE}</head><body><h1>{html.escape(self.title)}</h1>{''.join(self.parts)}"
                        "</body></html>\n")
        print(f"wrote {path}")

"""Hooks of mkdocs.yml: what the pages of this repository need to be a site.

The engines' README files are pages under engines/; GitHub's Markdown and Python's differ in when a list or a table may begin.
"""
import pathlib
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[1]
ENGINES = ROOT / "configs/engines"


def on_files(files, config):
    for file in list(files):
        if file.src_uri.startswith(("examples/", "shaders/")):
            files.remove(file)
    for readme in sorted(ENGINES.glob("*/README.md")):
        page = File(f"engines/{readme.parent.name}.md", str(ENGINES), config["site_dir"], config["use_directory_urls"])
        page.abs_src_path = str(readme)
        files.append(page)
    return files


def on_page_markdown(markdown, page, **_):
    if page.file.src_uri.startswith("engines/"):
        markdown = re.sub(r"\]\(\.\./\.\./\.\./docs/", "](../", markdown)
        markdown = re.sub(r"\]\(\.\./(\w+)/README\.md", r"](\1.md", markdown)
    else:
        markdown = re.sub(r"\]\((?:\.\./)+configs/engines/(\w+)/README\.md",
                          "](" + "../" * page.file.src_uri.count("/") + r"engines/\1.md", markdown)
    return with_blank_lines(markdown)


def with_blank_lines(markdown):
    """A blank line before every list and table that follows a paragraph at once."""
    out, fenced = [], False
    for line in markdown.split("\n"):
        before = out[-1] if out else ""
        if line.startswith("```"):
            fenced = not fenced
        starts = None if fenced or before.startswith(("    ", "\t")) else re.match(r"(\||- |\d+\. )", line)
        if starts and before.strip():
            same = before.startswith("|") if starts[1] == "|" else re.match(r"(- |\d+\. | )", before)
            if not same:
                out.append("")
        out.append(line)
    return "\n".join(out)

#!/usr/bin/env python3
"""Files of three.js that a page's modules import, directly or not: a line each, relative to the page's folder.

usage: imported_modules.py FOLDER MODULE
"""
import re
import sys
from pathlib import Path

IMPORT = re.compile(r"""(?:\bfrom\s*|\bimport\s*\(?\s*)["']([^"']+)["']""")
THREE = "node_modules/three/"


def file_of(name, importer):
    """As the import map of index.html says; None for what is not a file of ours or of three.js."""
    if name == "three":
        return Path(THREE + "build/three.module.js")
    if name.startswith("three/addons/"):
        return Path(THREE + "examples/jsm/" + name[len("three/addons/"):])
    if name.startswith("."):
        parts = []
        for part in (importer.parent / name).parts:
            if part == "..":
                parts.pop()
            elif part != ".":
                parts.append(part)
        return Path(*parts)
    return None


def main():
    folder, begin = Path(sys.argv[1]), Path(sys.argv[2])
    found, todo = {begin}, [begin]
    while todo:
        module = todo.pop()
        for name in IMPORT.findall((folder / module).read_text(encoding="utf-8")):
            file = file_of(name, module)
            if file and file not in found and (folder / file).is_file():
                found.add(file)
                todo.append(file)
    for file in sorted(map(str, found)):
        if file.startswith(THREE):
            print(file)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""What is inside a package: its copyright file (Debian's machine-readable form) and its SBOM (SPDX 2.3, JSON).

usage: inventory.py --package NAME --version V --programs FILE ... --source DIR --output DIR

Libraries are those that the programs name (DT_NEEDED), with the Debian package and version they come from here; code
that is compiled in comes from the packages that `./kiln` installs and that bring headers only.
"""
import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

# Compiled in: no library of theirs is needed at run time.
HEADERS = ("libasio-dev", "libcli11-dev", "libeigen3-dev", "libexpected-dev", "libglm-dev", "libtinygltf-dev",
           "nlohmann-json3-dev")


def output_of(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    return done.stdout if done.returncode == 0 else ""


def package_of(file):
    """Debian's package and its version, or None."""
    for name in (str(file), re.sub(r"^/usr(?=/lib)", "", str(file)), os.path.realpath(file)):
        owner = output_of("dpkg-query", "-S", name).split(": ")[0].split(",")[0]
        if owner:
            package, version = output_of("dpkg-query", "-W", "-f=${Package} ${Version}", owner).split(" ", 1)
            return package, version
    return None


def libraries(programs):
    found = set()
    for program in programs:
        needed = re.findall(r"NEEDED.*\[(.*)\]", output_of("readelf", "-d", str(program)))
        paths = dict(re.findall(r"(\S+) => (\S+)", output_of("ldd", str(program))))
        for name in needed:
            if name in paths and (package := package_of(paths[name])):
                found.add(package)
    return sorted(found)


def compiled_in(names):
    found = []
    for name in names:
        version = output_of("dpkg-query", "-W", "-f=${Version}", name)
        if version:
            found.append((name, version))
    return found


def three_js(source):
    file = source / "docs/examples/three/node_modules/three/package.json"
    return json.loads(file.read_text())["version"] if file.exists() else None


def sbom(options, linked, included, three):
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
    name = f"{options.package}-{options.version}"

    def entry(kind, package, version, relation):
        ref = "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", f"{kind}-{package}")
        purl = f"pkg:{kind}/debian/{package}@{version}" if kind == "deb" else f"pkg:{kind}/{package}@{version}"
        return {"SPDXID": ref, "name": package, "versionInfo": version, "downloadLocation": "NOASSERTION",
                "filesAnalyzed": False, "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER",
                                                          "referenceType": "purl", "referenceLocator": purl}]}, relation

    parts = [entry("deb", *p, "DYNAMIC_LINK") for p in linked] + [entry("deb", *p, "CONTAINS") for p in included]
    if three:
        parts.append(entry("npm", "three", three, "CONTAINS"))
    own = {"SPDXID": "SPDXRef-Package", "name": options.package, "versionInfo": options.version,
           "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseDeclared": "MIT",
           "copyrightText": "The Kiln authors"}
    packages = [own] + [part for part, _ in parts]
    digest = hashlib.sha256(json.dumps(packages, sort_keys=True).encode()).hexdigest()
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": name,
            "documentNamespace": f"urn:kiln:sbom:{name}:{digest[:32]}",
            "creationInfo": {"created": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(epoch)),
                             "creators": ["Tool: kiln-inventory"]},
            "packages": packages,
            "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                               "relatedSpdxElement": "SPDXRef-Package"}] +
                             [{"spdxElementId": "SPDXRef-Package", "relationshipType": relation,
                               "relatedSpdxElement": part["SPDXID"]} for part, relation in parts]}


def indented(text):
    return "".join(f" {line}\n" if line.strip() else " .\n" for line in text.strip().splitlines())


def copyright_of(options, included, three):
    own = (options.source / "LICENSE").read_text()
    holder = re.search(r"Copyright \(c\) (.*)", own).group(1)
    text = "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: Kiln\n\n"
    text += f"Files: *\nCopyright: {holder}\nLicense: MIT\n{indented(own.split(holder, 1)[1])}\n"
    if three:
        licence = (options.source / "docs/examples/three/node_modules/three/LICENSE").read_text()
        whose = re.search(r"Copyright .*", licence).group(0)
        text += f"Files: usr/share/kiln/examples/three/node_modules/*\nCopyright: {whose}\nLicense: three-MIT\n" \
                f"{indented(licence.split(whose, 1)[1])}\n"
    text += "Comment: compiled in, with the licences of their Debian packages, which follow:\n"
    text += "".join(f" {name} {version}\n" for name, version in included)
    for name, _ in included:
        file = Path("/usr/share/doc") / name / "copyright"
        if file.exists():
            text += f"\n-- {name}\n\n{file.read_text(errors='replace').strip()}\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--package", required=True)
    parser.add_argument("--version", required=True)
    parser.add_argument("--programs", type=Path, nargs="+", required=True)
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True)
    options = parser.parse_args()
    linked, three = libraries(options.programs), None
    worker = options.package == "kiln-worker"
    included = compiled_in([name for name in HEADERS
                            if not worker or name not in ("libcli11-dev", "libtinygltf-dev", "libeigen3-dev")])
    if not worker:
        three = three_js(options.source)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "sbom.spdx.json").write_text(json.dumps(sbom(options, linked, included, three), indent=1) + "\n")
    (options.output / "copyright").write_text(copyright_of(options, included, three))
    return 0


if __name__ == "__main__":
    sys.exit(main())

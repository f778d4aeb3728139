"""The settings' table of docs/settings.md, from what `kiln help bake` prints.

usage: settings_reference.py KILN            prints the table
       settings_reference.py KILN --write    puts it into docs/settings.md

Every setting needs a place in PAGES: its group, and the page with the picture or the numbers behind it.
"""
import pathlib
import re
import subprocess
import sys

BEGIN, END = "<!-- settings -->\n", "<!-- end of settings -->"
PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/settings.md"

PAGES = {
    "Layout and density": {
        "engines.md": "layout resolution",
        "density.md": "texels-per-metre max-texels importance-box importance-cameras camera-distance unseen-density "
                      "small-objects",
        "density.md#what-nobody-sees": "unseen",
        "density.md#what-light-makes-superfluous": "two-pass",
        "packing.md": "page-size power-of-two block-align mip-levels",
        "unwrap.md": "unwrap",
        "unwrap.md#cache": "unwrap-cache",
        "leaks.md": "contact-cuts",
        "engines.md#keeping-a-layout": "keep-layout",
    },
    "Light": {
        "radiometry.md": "environment environment-rotation components split max-bounces",
        "scenes.md": "environment-strength",
        "scenes.md#a-sun-left-in-an-environment-image": "sun sun-angle",
        "materials.md": "materials",
        "gltf.md#what-is-read": "variant",
    },
    "Accuracy and time": {
        "samples.md#allocation-coordinatorbakesamplingallocationh": "error confidence error-norm min-samples max-samples",
        "real_scenes.md#within-a-time-limit": "time-limit",
        "error_vs_time.md#bias-of-the-irradiance-cache": "cache",
        "denoising.md": "denoise",
        "performance.md#sampling": "sampler",
        "samples.md": "seed",
        "performance.md": "watertight isa",
    },
    "What is stored": {
        "responses.md": "quantities ao-distance ao-falloff",
        "responses.md#reported-error": "visibility-error",
        "bases.md": "basis sh-fit sh-evaluator",
        "seams.md": "seams seam-angle",
        "engines.md#which-texels-to-trust": "dilate",
    },
    "Probes": {
        "probes.md": "probes probe-spacing probe-max-spacing max-probes probe-visibility probe-dering probe-files",
    },
    "Textures": {
        "encoding.md": "encode container encode-effort encode-metric encode-quantity encode-units encode-range ktx2-zstd",
        "encoding.md#measured-errors": "max-encode-error",
    },
    "Files": {
        "engines.md#scene_instancedglb": "instanced",
        "gltf.md": "gltf-lightmap",
        "gltf.md#scene_unlitglb": "embed-basecolor",
        "gltf.md#lamps": "lamps",
        "density.md#where-pictures-are-seen-from": "preview camera",
        "lods.md": "lod lod-distance lod-split",
    },
    "Machines": {
        "operating.md": "workers threads",
        "performance.md#what-the-farm-costs-on-one-machine": "tile-texels",
        "farm.md#a-units-life": "lease-ms",
    },
}


def settings(kiln):
    """Rows of `kiln help bake`: (name, placeholder, text), in its order."""
    out = subprocess.run([kiln, "help", "bake"], capture_output=True, text=True, check=True).stdout
    rows = []
    for line in out[out.index("\nSettings:"):out.index("\nExample")].splitlines():
        if match := re.match(r"  --(\S+) (\S+)\s*(.*)", line):
            rows.append(list(match.groups()))
        elif line.startswith("   ") and rows:
            rows[-1][2] = (rows[-1][2] + " " + line.strip()).strip()
    return rows


def table(kiln):
    rows = settings(kiln)
    group_of, page_of = {}, {}
    for group, pages in PAGES.items():
        for page, names in pages.items():
            for name in names.split():
                assert name not in group_of, f"{name} is in PAGES twice"
                group_of[name], page_of[name] = group, page
    known = {name for name, _, _ in rows}
    assert known == set(group_of), f"PAGES lacks {sorted(known - set(group_of))} or has {sorted(set(group_of) - known)}"
    text = ""
    for group in PAGES:
        text += f"\n## {group}\n\n| setting | value | default | what it does | more |\n|---|---|---|---|---|\n"
        for name, value, about in rows:
            if group_of[name] != group:
                continue
            default = ""
            if match := re.search(r" \[([^\]]*)\](?: \(([^()]*)\))?$", about):
                default = " ".join(filter(None, match.groups()))
                about = about[:match.start()]
            title = page_of[name].split(".md")[0]
            cells = [f"`--{name}`", f"`{value}`", default, about, f"[{title}]({page_of[name]})"]
            text += "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
    return text + "\n"


def main():
    made = table(sys.argv[1])
    if "--write" not in sys.argv:
        print(made)
        return
    page = PAGE.read_text()
    PAGE.write_text(page[:page.index(BEGIN) + len(BEGIN)] + made + page[page.index(END):])


if __name__ == "__main__":
    main()

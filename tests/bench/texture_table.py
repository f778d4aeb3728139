#!/usr/bin/env python3
"""The quality table of docs/encoding.md: bakes scenes once, then encodes them in every way.

    tests/bench/texture_table.py [--out DIR] [--samples N] [--denoise off|on] [SCENE ...]

Without scenes: the demo, and of the shared scenes those that are there. Bakes that DIR holds already are used again. One
core does the encoding, so Mtexel/s are of a core. Prints Markdown; DIR/table.json has all numbers.
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
KILN = ROOT / 'build/bin/kiln'
DEMO = ROOT / 'tests/scenes/arcade/arcade.gltf'
SHARED = ROOT.parent / 'shared/scenes'
REAL = ['sponza_lm.glb', 'pc_house.glb', 'MixedLightingExample.glb']
EFFORTS = {'bc6h': ['fast', 'normal', 'best'], 'bc6h-bc1': ['normal'], 'bc6h-plain': ['normal'],
           'astc-4x4': ['normal'], 'astc-6x6': ['normal'], 'astc-8x8': ['normal'], 'half': ['normal'], 'rgb9e5': ['normal'],
           'rgbe': ['normal'], 'rgbm': ['normal'], 'rgbd': ['normal'], 'hdr': ['normal']}


def light_options(scene):
    """What a file cannot hold: NAME.json beside a shared scene."""
    sidecar = scene.with_suffix('.json')
    if not sidecar.exists() or scene.suffix != '.glb':
        return []
    light = json.loads(sidecar.read_text())
    options = []
    if 'environment' in light:
        options += ['--environment', ','.join(map(str, light['environment']['radiance']))]
    if 'sun' in light:
        options += ['--sun', ':'.join(','.join(map(str, light['sun'][k])) for k in ('to_light', 'irradiance'))]
        options += ['--sun-angle', str(math.degrees(light.get('sun_angular_diameter_rad', 0)))]
    return options


def bake(scene, folder, samples, denoise):
    if (folder / 'report.json').exists():
        return
    command = [KILN, 'bake', scene, '-o', folder, '--encode', 'none', '--min-samples', str(samples), '--max-samples',
               str(samples), '--max-texels', '300000', '--resolution', '512', '--quiet', '--denoise', denoise,
               *light_options(scene)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f'{scene.name}: {done.stderr}')


def encode(scene, folder, name, effort, core):
    with tempfile.TemporaryDirectory() as out:
        command = [KILN, 'encode', scene, '--from', folder, '-o', out, '--encode', name, '--container', 'ktx2',
                   '--encode-effort', effort, '--encode-quantity', 'both', '--max-encode-error', '0', '--json', '--quiet']
        done = subprocess.run(command, capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, {core}))
    if done.returncode:
        sys.exit(f'{scene.name} {name}: {done.stderr}')
    return json.loads(done.stdout)['textures']


def row(t):
    seams = t.get('seams')
    steps = f"{100 * seams['rms_step_before']:.2f} to {100 * seams['rms_step_after']:.2f} %" if seams else '-'
    off = t['at_normals'][0]['rms']
    return (f"| {t['encoding']} | {'E' if t['quantity'] == 'irradiance' else 'L1'} | {t['effort'] if t['effort'] != 'none' else '-'} "
            f"| {t['bits_per_texel']:.1f} | {100 * off:.2g} % | {t['psnr_log_db']:.1f} | {t['rel_mse']:.1e} | {t['rel_mse_of_filtering_alone']:.1e} "
            f"| {100 * t['worst_block']['relative_rms_error']:.2g} % | {100 * t['worst_texel']['relative_rms_error']:.2g} % "
            f"| {steps} | {t['megatexels_per_second']:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scenes', nargs='*', type=pathlib.Path)
    parser.add_argument('--out', type=pathlib.Path, default=pathlib.Path(tempfile.gettempdir()) / 'kiln-texture-table')
    parser.add_argument('--samples', type=int, default=512)
    parser.add_argument('--denoise', choices=('off', 'on'), default='off')
    a = parser.parse_args()
    scenes = a.scenes or [DEMO] + [SHARED / name for name in REAL if (SHARED / name).exists()]
    if not a.scenes and len(scenes) < 1 + len(REAL):
        print('(shared scenes are not here: the demo alone)', file=sys.stderr)
    core, everything = min(os.sched_getaffinity(0)), {}
    for scene in scenes:
        folder = a.out / (scene.stem + ('-denoised' if a.denoise == 'on' else ''))
        folder.mkdir(parents=True, exist_ok=True)
        bake(scene, folder, a.samples, a.denoise)
        rows = [t for name, efforts in EFFORTS.items() for effort in efforts for t in encode(scene, folder, name, effort, core)]
        everything[folder.name] = rows
        print(f'\n**{folder.name}**, {rows[0]["texels"]} texels of charts\n')
        print('| encoding | holds | effort | bits | off E | PSNR log, dB | relMSE | of filtering | worst block | worst texel '
              '| step at seams | Mtexel/s |')
        print('|---|---|---|---|---|---|---|---|---|---|---|---|')
        seen = set()
        for t in rows:
            key = (t['encoding'], t['quantity'], t['effort'])
            # E of bc6h, bc6h-bc1 and bc6h-plain is the same texture.
            if key in seen or (t['quantity'] == 'irradiance' and t['encoding'] in ('bc6h-bc1', 'bc6h-plain')):
                continue
            seen.add(key)
            print(row(t), flush=True)
    (a.out / 'table.json').write_text(json.dumps(everything, indent=1))


if __name__ == '__main__':
    main()

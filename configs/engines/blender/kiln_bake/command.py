"""The command line of a bake. Knows nothing of Blender."""

import shlex

PRESETS = {
    "PREVIEW": ["--error", "20%", "--min-samples", "32", "--max-samples", "256"],
    "DEFAULT": [],
    "PRODUCTION": ["--error", "3%", "--confidence", "95%", "--min-samples", "128"],
}


def quality(preset, error, minutes):
    if preset == "ERROR":
        return ["--error", "{:g}%".format(error)]
    if preset == "TIME":
        return ["--time-limit", "{:g}s".format(60 * minutes)]
    return PRESETS[preset]


def bake(program, scene, folder, preset, error, minutes, layout, density, resolution, environment, extra):
    command = [program, "bake", scene, "-o", folder, *quality(preset, error, minutes)]
    if layout == "ATLAS":
        command += ["--layout", "atlas", "--resolution", str(resolution)]
    else:
        command += ["--layout", "pack", "--texels-per-metre", "{:g}".format(density)]
    if environment:
        command += ["--environment", environment]
    return command + shlex.split(extra)


def server(server, token_file, ca, certificate, key):
    out = ["--server", server]
    for name, value in (("--token-file", token_file), ("--ca", ca), ("--certificate", certificate), ("--key", key)):
        if value:
            out += [name, value]
    return out


def submit(bake_command, name, server_options):
    """The same bake by a farm: waits, and fetches the results into the same folder."""
    program, _, scene, output, folder, *settings = bake_command
    return [program, "submit", scene, output, folder, "--wait", "--name", name, *settings, *server_options]


def cancel(program, job, server_options):
    return [program, "cancel", str(job), *server_options]

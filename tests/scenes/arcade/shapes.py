"""Lathed, swept and flat shapes. A profile is a list of runs; the points of a run are shaded smoothly, runs
meet in edges. Walking along a profile its front is on the right: up for a wall seen from +x.
"""
import math

PI = math.pi


def arc(count, start=0.0, end=PI):
    return [start + (end - start) * i / count for i in range(count + 1)]


def profile_points(runs):
    """Runs of (a, b) as runs of (a, b, normal a, normal b, length so far)."""
    out, length = [], 0.0
    for run in runs:
        pieces = []
        for (a0, b0), (a1, b1) in zip(run, run[1:]):
            size = math.sqrt((a1 - a0) ** 2 + (b1 - b0) ** 2)
            pieces.append(((b1 - b0) / size, -(a1 - a0) / size, size))
        points = []
        for i, (a, b) in enumerate(run):
            near = pieces[max(0, i - 1):i + 1]
            n = (sum(p[0] for p in near), sum(p[1] for p in near))
            size = math.sqrt(n[0] ** 2 + n[1] ** 2)
            if i > 0:
                length += pieces[i - 1][2]
            points.append((a, b, n[0] / size, n[1] / size, length))
        out.append(points)
    return out


def edges(points):
    """A profile of sharp edges: every pair a run of its own."""
    return [[p, q] for p, q in zip(points, points[1:])]


def curve(a0, b0, a1, b1, kind, count=4):
    """A quarter of an ellipse between two points: 'out' leaves along a, 'up' leaves along b."""
    points = []
    for t in arc(count, 0.0, PI / 2):
        f, g = (math.sin(t), 1 - math.cos(t)) if kind == "out" else (1 - math.cos(t), math.sin(t))
        points.append((a0 + (a1 - a0) * f, b0 + (b1 - b0) * g))
    return points


def lathe(mesh, runs, sides, tile=1.0, centre=(0.0, 0.0, 0.0), pole=None):
    """Turns (radius, height) about +y. One chart: a strip, or, where the profile begins or ends on the axis
    (pole 'first' or 'last'), a disc around that pole."""
    mesh.chart()
    runs = profile_points(runs)
    all_points = [p for run in runs for p in run]
    radius = sum(p[0] for p in all_points) / len(all_points)
    total = all_points[-1][4]
    for run in runs:
        rows = []
        for r, y, nr, ny, length in run:
            row = []
            for t in arc(sides, 0.0, 2 * PI):
                c, s = math.cos(t), math.sin(t)
                far = length if pole == "first" else total - length
                row.append(((centre[0] + r * c, centre[1] + y, centre[2] - r * s), (nr * c, ny, -nr * s),
                            (far * c, far * s) if pole else (radius * t, length)))
            rows.append(row)
        mesh.grid(rows, tile)


def ball(mesh, radius, rings, sides, centre):
    """A sphere of two discs."""
    for pole, start, end in (("first", -PI / 2, 0.0), ("last", 0.0, PI / 2)):
        lathe(mesh, [sphere_run(radius, rings, 0.0, start, end)], sides, 1.0, centre, pole)


def arc_sweep(mesh, runs, place, angles, radius, tile=1.0, turn=False):
    """Sweeps (r, d) along an arc; place(angle, r, d) gives a point, place with direction=True a vector."""
    mesh.chart()
    for run in profile_points(runs):
        mesh.grid([[(place(t, r, d, False), place(t, nr, nd, True), (radius * t, length)) for t in angles]
                   for r, d, nr, nd, length in run], tile, turn)


def wall_arc(centre_x, centre_y):
    """Arcs in the plane of a wall: d is +z."""
    def place(t, r, d, direction):
        p = (-r * math.cos(t), r * math.sin(t), d)
        return p if direction else (p[0] + centre_x, p[1] + centre_y, d)
    return place


def opening_path(half, foot, spring, count=12):
    """The edge of an arched opening from its left foot: (x, y, outward x, outward y, length so far)."""
    path = [(-half, foot, -1.0, 0.0, 0.0)]
    start = spring - foot
    for t in arc(count):
        path.append((-half * math.cos(t), spring + half * math.sin(t), -math.cos(t), math.sin(t), start + half * t))
    path.append((half, foot, 1.0, 0.0, 2 * start + half * PI))
    return path


def path_sweep(mesh, runs, path, tile=1.0):
    """Sweeps (outward offset, +z) along an opening_path. One chart."""
    mesh.chart()
    for run in profile_points(runs):
        mesh.grid([[((x + o * ox, y + o * oy, d), (no * ox, no * oy, nd), (along, length))
                    for x, y, ox, oy, along in path] for o, d, no, nd, length in run], tile)


def loop_sweep(mesh, loop, runs, tile=1.0, outward=True):
    """Sweeps (offset, height) round a closed polygon of (x, z), mitred at its corners. Anticlockwise seen
    from above (+x towards -z) the offset goes outward. Each side is a chart."""
    count = len(loop)
    sign = 1.0 if outward else -1.0
    normal = []
    for i in range(count):
        (x0, z0), (x1, z1) = loop[i], loop[(i + 1) % count]
        size = math.sqrt((x1 - x0) ** 2 + (z1 - z0) ** 2)
        normal.append((-(z1 - z0) / size * sign, (x1 - x0) / size * sign, size))
    mitre = []
    for i in range(count):
        a, b = normal[i - 1], normal[i]
        k = 1.0 + a[0] * b[0] + a[1] * b[1]
        mitre.append(((a[0] + b[0]) / k, (a[1] + b[1]) / k))
    start = 0.0
    for i in range(count):
        j = (i + 1) % count
        (x0, z0), (x1, z1) = loop[i], loop[j]
        nx, nz, size = normal[i]
        mesh.chart()
        ux, uz = (x1 - x0) / size, (z1 - z0) / size
        for run in profile_points(runs):
            rows = []
            for o, h, no, nh, length in run:
                row = []
                for (x, z), (mx, mz) in ((loop[i], mitre[i]), (loop[j], mitre[j])):
                    px, pz = x + o * mx, z + o * mz
                    along = (px - x0) * ux + (pz - z0) * uz
                    row.append(((px, h, pz), (no * nx, nh, no * nz), (start + along, length)))
                rows.append(row)
            mesh.grid(rows, tile)
        start += size


def square(half_x, half_z=None, centre=(0.0, 0.0)):
    """Anticlockwise seen from above."""
    hz = half_x if half_z is None else half_z
    cx, cz = centre
    return [(cx - half_x, cz + hz), (cx + half_x, cz + hz), (cx + half_x, cz - hz), (cx - half_x, cz - hz)]


def regular(count, radius, phase=0.0):
    return [(radius * math.cos(phase + 2 * PI * i / count), -radius * math.sin(phase + 2 * PI * i / count))
            for i in range(count)]


def cap(mesh, loop, y, up=True, tile=1.0):
    """A convex polygon as a flat face."""
    mesh.chart()
    n = (0.0, 1.0 if up else -1.0, 0.0)
    index = [mesh.vertex((x, y, z), n, (x / tile, z / tile), (x, z)) for x, z in loop]
    for i in range(1, len(index) - 1):
        mesh.triangle(index[0], index[i], index[i + 1])


def wall_strips(mesh, columns, z, tile=1.0):
    """A flat wall facing +z of strips between columns. A column is (x, heights), or (x, heights of the strip
    on its left, of that on its right) where they differ; None in the heights is a hole. One chart."""
    mesh.chart()
    front = (0.0, 0.0, 1.0)
    for left, right in zip(columns, columns[1:]):
        spans = list(zip(left[-1], right[1]))
        for low, high in zip(spans, spans[1:]):
            if None not in low + high:
                mesh.grid([[((left[0], y[0], z), front, (left[0], y[0])), ((right[0], y[1], z), front, (right[0], y[1]))]
                           for y in (low, high)], tile)


def sphere_run(radius, count, centre=0.0, start=-PI / 2, end=PI / 2):
    return [(max(0.0, radius * math.cos(t)), centre + radius * math.sin(t)) for t in arc(count, start, end)]

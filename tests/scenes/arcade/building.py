"""The house: bays of the arcade, its walk, corners, mouldings and roof.

A bay's own frame: x along the wall, +z into the court, z = 0 the court face of the arcade wall, y = 0 the floor
of the walk. A corner's frame: the court's inner corner at the origin, the court towards +x and +z.
"""
import math

from mesh import Mesh
from shapes import (PI, arc, arc_sweep, cap, curve, edges, lathe, loop_sweep, opening_path, path_sweep, square,
                    wall_arc, wall_strips)

BAY = 2.6
ALONG_X, ALONG_Z = 4, 6                   # bays on the short and the long sides
HALF_X, HALF_Z = 5.3, 7.9                 # court faces of the arcade walls
THICK, CLEAR = 0.4, 2.3                   # arcade wall; width of the walk
BACK = THICK + CLEAR                      # outer wall's inner face
SPRING, R_ARCH, R_VAULT = 2.7, 1.05, 1.15
R_FACE = 1.21                             # outer edge of the archivolt
LEDGE, STRING, STRING_TOP = 2.55, 4.15, 4.4   # under the lunettes; between the storeys
CORNICE, EAVE = 6.05, 6.55
COURT_Y = -0.16
STEP = 0.3                                # the walk's floor reaches this far into the court
OUTSIDE, ROOF_REACH, PITCH = BACK + 0.4, BACK + 0.65, 0.42
ARC = 20


def arch_height(x, r):
    return SPRING + math.sqrt(max(0.0, r * r - x * x))


def arch_xs(r, count=ARC):
    return [-r * math.cos(t) for t in arc(count)]


def floor():
    m = Mesh("walk floor", "tiles")
    x0, z0, x1, z1 = HALF_X - STEP, HALF_Z - STEP, HALF_X + BACK, HALF_Z + BACK
    for sx in (-1, 1):
        a, b = sorted((sx * x0, sx * x1))
        m.quad((a, 0, z1), (b, 0, z1), (b, 0, -z1), (a, 0, -z1), 1.3)
    for sz in (-1, 1):
        a, b = sorted((sz * z0, sz * z1))
        m.quad((-x0, 0, b), (x0, 0, b), (x0, 0, a), (-x0, 0, a), 1.3)
    court = Mesh("court floor", "flags")
    court.quad((-x0, COURT_Y, z0), (x0, COURT_Y, z0), (x0, COURT_Y, -z0), (-x0, COURT_Y, -z0), 2.6)
    step = Mesh("step", "stone")
    # Seen from the court: the loop is the court's edge, offset inwards.
    profile = edges([(0.0, COURT_Y), (0.0, -0.05), (0.03, -0.05)]) + [curve(0.03, -0.05, 0.0, 0.0, "up", 3)]
    loop_sweep(step, square(x0, z0), profile, 1.3, outward=False)
    return [m, court, step]


def arcade_wall(name, left, right):
    """The court face around an arch, from its springing to the string course."""
    m = Mesh(name, "ashlar")
    columns = [(left, [SPRING, STRING])]
    columns += [(x, [arch_height(x, R_FACE), STRING]) for x in arch_xs(R_FACE)]
    wall_strips(m, columns + [(right, [SPRING, STRING])], 0.0, 1.3)
    return m


def arch_ring():
    """Archivolt, soffit and the strip on the walk's side, in one sweep."""
    m = Mesh("arch ring", "stone")
    runs = edges([(R_FACE, 0.0), (R_FACE, 0.035), (1.185, 0.035)])
    runs.append(curve(1.185, 0.035, 1.15, 0.06, "up", 4))
    runs += edges([(1.15, 0.06), (1.12, 0.06), (1.12, 0.03), (R_ARCH, 0.03), (R_ARCH, -THICK), (R_VAULT, -THICK)])
    arc_sweep(m, runs, wall_arc(0.0, SPRING), arc(ARC), R_ARCH, 1.3)
    key = Mesh("keystone", "stone")
    corners = ((-0.085, 3.72), (0.085, 3.72), (0.12, STRING), (-0.12, STRING))
    a, b, c, d = [(x, y, 0.09) for x, y in corners]
    back = [(x, y, 0.0) for x, y in corners]
    key.quad(a, b, c, d)
    key.quad(back[0], back[1], b, a)
    key.quad(back[0], a, d, back[3])
    key.quad(b, back[1], back[2], c)
    return [m, key]


def vault(centre=(0.0, 0.0)):
    """A groin vault over a square: four webs, each unrolled."""
    m = Mesh("vault", "cream")
    for web in range(4):
        m.chart()
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[web]
        rows = []
        for end in (0, 1):
            row = []
            for t in arc(ARC):
                z, n = -R_VAULT * math.cos(t), (0.0, -math.sin(t), math.cos(t))
                x = R_VAULT if end else abs(z)
                row.append(((c * x - s * z + centre[0], SPRING + R_VAULT * math.sin(t), s * x + c * z + centre[1]),
                            (-s * n[2], n[1], c * n[2]), (R_VAULT * t, x)))
            rows.append(row)
        m.grid(rows, 2.6)
    return m


def rib(name, x0, x1, along_x=False):
    """A transverse arch over the walk between x0 and x1 (or, for along_x, between z0 and z1)."""
    m = Mesh(name, "stone")
    middle = -(THICK + CLEAR / 2)

    def place(t, r, d, direction):
        base = (d, r * math.sin(t), -r * math.cos(t))
        if not direction:
            base = (base[0], base[1] + SPRING, base[2] + middle)
        return (base[2], base[1], base[0]) if along_x else base
    # Towards the left: the profile's front is its right hand.
    runs = edges([(R_VAULT, x1), (R_ARCH, x1), (R_ARCH, x0), (R_VAULT, x0)])
    arc_sweep(m, runs, place, arc(ARC), R_ARCH, 1.3)
    return m


def back_wall(name, left, right):
    """The walk's outer wall below the ledge."""
    m = Mesh(name, "plaster")
    wall_strips(m, [(left, [0.18, LEDGE]), (right, [0.18, LEDGE])], -BACK, 2.6)
    return m


DOOR = (0.5, 0.0, 1.72)       # half width, foot, springing
NICHE = (0.42, 0.9, 1.75)
WINDOW = (0.42, 4.86, 5.28)


def opened_wall(name, material, opening, low, high, left, right, z, frame, foot=None):
    """A wall with an arched hole as wide as the opening's frame; foot: where the hole begins."""
    half, bottom, spring = opening
    half += frame
    m = Mesh(name, material)
    foot = bottom if foot is None else foot
    full = sorted({low, foot, spring, high})
    bored = [low, foot, None, spring, high] if foot > low else [None, spring, high]
    columns = [(left, full), (-half, full, bored)]
    for x in arch_xs(half, 12)[1:-1]:
        y = spring + math.sqrt(half * half - x * x)
        columns.append((x, [low, foot, None, y, high] if foot > low else [None, y, high]))
    columns += [(half, bored, full), (right, full)]
    wall_strips(m, columns, z, 2.6 if material != "ashlar" else 1.3)
    return m


def surround(name, opening, depth, z, frame, proud=0.05):
    """The frame and the reveal of an arched opening."""
    m = Mesh(name, "stone")
    half, foot, spring = opening
    path = [(x, y, ox, oy, s) for x, y, ox, oy, s in opening_path(half, foot, spring)]
    runs = edges([(frame, z), (frame, z + proud * 0.6), (frame * 0.6, z + proud * 0.6)])
    runs.append(curve(frame * 0.6, z + proud * 0.6, frame * 0.45, z + proud, "up", 3))
    runs += edges([(frame * 0.45, z + proud), (0.0, z + proud), (0.0, z - depth)])
    path_sweep(m, runs, path, 1.3)
    return m


def leaf(name, material, opening, z, tile):
    """What closes an arched opening: a flat panel."""
    half, foot, spring = opening
    m = Mesh(name, material)
    m.chart()
    rows = [[], []]
    for x in arch_xs(half, 12):
        y = spring + math.sqrt(max(0.0, half * half - x * x))
        for row, h in zip(rows, (foot, y)):
            row.append(((x, h, z), (0, 0, 1), (x, h)))
    m.grid(rows, 1.0)
    low, high = min(v for _, v in m.st), max(v for _, v in m.st)
    if tile == 0:  # the texture once over the whole panel
        m.uv0 = [(round(0.5 + s / (2 * half), 5), round((high - t) / (high - low), 5)) for s, t in m.st]
    else:
        m.uv0 = [(round(s / tile, 5), round(-t / tile, 5)) for s, t in m.st]
    return m


def lunette():
    m = Mesh("lunette", "cream")
    wall_strips(m, [(x, [SPRING, arch_height(x, R_VAULT)]) for x in arch_xs(R_VAULT)], -BACK, 2.6)
    return m


def sill():
    m = Mesh("sill", "stone")
    m.box((-0.6, WINDOW[1] - 0.1, -0.24), (0.6, WINDOW[1], 0.11), "k")
    return m


def upper_wall(name, left, right, with_window=True):
    if with_window:
        return opened_wall(name, "ochre", WINDOW, STRING_TOP, CORNICE, left, right, 0.0, 0.11, WINDOW[1] - 0.1)
    m = Mesh(name, "ochre")
    wall_strips(m, [(left, [STRING_TOP, CORNICE]), (right, [STRING_TOP, CORNICE])], 0.0, 2.6)
    return m


def column():
    """Plinth, Attic base, shaft with entasis, bell capital and abacus; the axis is the middle of the wall."""
    m = Mesh("column", "stone")
    loop_sweep(m, square(0.0001), edges([(0.29, 0.0), (0.29, 0.12), (0.17, 0.12)]), 1.3)
    torus = [(0.228 + 0.034 * math.cos(t), 0.155 + 0.035 * math.sin(t)) for t in arc(5, -PI / 2, PI / 2)]
    scotia = curve(0.222, 0.19, 0.205, 0.222, "up", 3)
    upper = [(0.207 + 0.022 * math.cos(t), 0.246 + 0.022 * math.sin(t)) for t in arc(4, -PI / 2, PI / 2)]
    lathe(m, [torus, [(0.228, 0.19), (0.222, 0.19)], scotia, [(0.205, 0.222), (0.207, 0.224)], upper], 24, 1.3)
    shaft = []
    for i in range(9):
        h = i / 8
        shaft.append((0.192 - 0.03 * h * h + 0.006 * math.sin(PI * h), 0.268 + (2.16 - 0.268) * h))
    neck = [(0.162 + 0.02 * math.cos(t), 2.18 + 0.02 * math.sin(t)) for t in arc(4, -PI / 2, PI / 2)]
    lathe(m, [[(0.207, 0.268), (0.192, 0.268)], shaft], 24, 1.3)
    bell = [(0.163 + 0.117 * (i / 7) ** 2.0 + 0.02 * (i / 7), 2.2 + 0.3 * i / 7) for i in range(8)]
    roll = [(0.285 + 0.02 * math.cos(t), 2.525 + 0.025 * math.sin(t)) for t in arc(5, -PI / 2, PI / 2)]
    lathe(m, [neck, bell, roll], 24, 1.3)
    loop_sweep(m, square(0.0001), edges([(0.19, 2.55), (0.285, 2.55), (0.285, 2.6)])
               + [curve(0.285, 2.6, 0.315, 2.64, "up", 3)] + edges([(0.315, 2.64), (0.315, SPRING), (0.19, SPRING)]), 1.3)
    return m


def pier():
    """The corner: an L of masonry under the ends of two arcades."""
    m = Mesh("corner pier", "ashlar")
    a, b = -THICK - 0.06, 0.06
    end = 1.4 - R_ARCH + 0.06
    loop = [(a, end), (b, end), (b, b), (end, b), (end, a), (a, a)]
    base = edges([(0.07, 0.0), (0.07, 0.16)]) + [curve(0.07, 0.16, 0.0, 0.26, "up", 4)]
    top = [curve(0.0, 2.48, 0.05, 2.56, "up", 4)] + edges([(0.05, 2.56), (0.05, SPRING), (-0.05, SPRING)])
    loop_sweep(m, loop, base + edges([(0.0, 0.26), (0.0, 2.48)]) + top, 1.3)
    return m


def corner_walls():
    """The walk's outer walls and lunettes at a corner; ribs and vault over it."""
    walls = Mesh("corner walls", "plaster")
    walls.quad((-BACK, 0.18, -BACK), (0.1, 0.18, -BACK), (0.1, LEDGE, -BACK), (-BACK, LEDGE, -BACK), 2.6)
    walls.quad((-BACK, 0.18, 0.1), (-BACK, 0.18, -BACK), (-BACK, LEDGE, -BACK), (-BACK, LEDGE, 0.1), 2.6)
    middle = -(THICK + CLEAR / 2)
    upper = Mesh("corner lunettes", "cream")
    upper.chart()
    rows = [[], []]
    for x in arch_xs(R_VAULT):
        for row, y in zip(rows, (SPRING, arch_height(x, R_VAULT))):
            row.append(((x + middle, y, -BACK), (0, 0, 1), (x, y)))
    upper.grid(rows, 2.6)
    upper.chart()
    upper.grid([[((p[2], p[1], p[0]), (1, 0, 0), st) for p, _, st in row] for row in rows], 2.6)
    return [walls, upper, rib("corner rib x", -THICK, 0.25), rib("corner rib z", -THICK, 0.25, True),
            vault((middle, middle))]


def mouldings():
    """Everything that runs round the court or the walk, seen from inside."""
    court, walk = square(HALF_X, HALF_Z), square(HALF_X + BACK, HALF_Z + BACK)

    def ring(name, loop, runs, material="stone"):
        m = Mesh(name, material)
        loop_sweep(m, loop, runs, 1.3, outward=False)
        return m
    string = [curve(0.0, STRING, 0.05, 4.2, "up", 4)] + edges([(0.05, 4.2), (0.08, 4.2), (0.08, 4.27)])
    string += [curve(0.08, 4.27, 0.14, 4.33, "up", 4)] + edges([(0.14, 4.33), (0.14, 4.365), (0.0, STRING_TOP)])
    cornice = edges([(0.0, CORNICE), (0.03, CORNICE), (0.03, 6.11), (0.06, 6.11)])
    cornice += [curve(0.06, 6.11, 0.13, 6.19, "up", 5)] + edges([(0.13, 6.19), (0.30, 6.19), (0.30, 6.29)])
    cornice += [curve(0.30, 6.29, 0.345, 6.35, "out", 3), curve(0.345, 6.35, 0.39, 6.41, "up", 3)]
    cornice += edges([(0.39, 6.41), (0.39, 6.45), (0.28, 6.47)])
    ledge = edges([(0.0, LEDGE), (0.03, LEDGE), (0.03, 2.58)]) + [curve(0.03, 2.58, 0.10, 2.65, "up", 4)]
    ledge += edges([(0.10, 2.65), (0.125, 2.65), (0.125, SPRING), (0.0, SPRING)])
    skirting = edges([(0.035, 0.0), (0.035, 0.14)]) + [curve(0.035, 0.14, 0.0, 0.18, "up", 3)]
    return [ring("string course", court, string), ring("cornice", court, cornice), ring("ledge", walk, ledge),
            ring("skirting", walk, skirting)]


def dentils(count):
    """A row of blocks under the cornice, centred; three sides and the underside of each unrolled to one chart."""
    m = Mesh("dentils", "stone")
    pitch, wide, low, high, back, front = BAY / count, 0.08, 6.075, 6.19, 0.03, 0.24
    deep = front - back
    for i in range(count):
        x = (i - (count - 1) / 2) * pitch
        plan = [(x - wide, back, 0.0), (x - wide, front, deep), (x + wide, front, deep + 2 * wide),
                (x + wide, back, 2 * deep + 2 * wide)]
        m.chart()
        for (x0, z0, s0), (x1, z1, s1) in zip(plan, plan[1:]):
            m.quad((x0, low, z0), (x1, low, z1), (x1, high, z1), (x0, high, z0), 1.0,
                   ((s0, 0), (s1, 0), (s1, high - low), (s0, high - low)))
        m.quad((x - wide, low, back), (x + wide, low, back), (x + wide, low, front), (x - wide, low, front), 1.0,
               ((deep, -deep), (deep + 2 * wide, -deep), (deep + 2 * wide, 0), (deep, 0)))
    return m


def bracket():
    """A console under the ledge where a rib comes down."""
    m = Mesh("bracket", "stone")
    front = [(0.0, 2.12), (0.05, 2.14), (0.085, 2.2), (0.08, 2.28), (0.06, 2.36), (0.075, 2.46), (0.11, LEDGE)]
    m.chart()
    points, length = [], 0.0
    for i, (d, y) in enumerate(front):
        a, b = front[max(0, i - 1)], front[min(len(front) - 1, i + 1)]
        if i:
            length += math.hypot(d - front[i - 1][0], y - front[i - 1][1])
        points.append((d, y, (0, -(b[0] - a[0]), b[1] - a[1]), length))
    m.grid([[((x, y, d - BACK), n, (x, t)) for x in (-0.1, 0.1)] for d, y, n, t in points], 1.3)
    for x, side in ((-0.1, -1), (0.1, 1)):
        m.chart()
        m.grid([[((x, y, v - BACK), (side, 0, 0), (v, y)) for v in (0.0, d)] for d, y in front], 1.3)
    return m


def roof_side(name, half, tiles):
    """One side of the roof over a court side of half the given length: barrel tiles down the slope, three
    stepped courses at the eave. x along, t outward, both measured at the court's face."""
    m = Mesh(name, "roof")
    reach, overhang, wave, lift, course = ROOF_REACH, 0.46, 0.045, 0.035, 0.42
    left = -(half + reach)
    pitch = 2 * (half + reach) / tiles
    lines = []
    for i in range(tiles * 4 + 1):
        k = i % 4
        lines.append((left + pitch * i / 4, (0.0, 0.5, 1.0, 0.5)[k], (0.0, -0.55, 0.0, 0.55)[k]))
    starts = [-overhang + k * course for k in range(4)] + [reach]

    def point(x, t, up):
        return (x, EAVE + (t + overhang) * PITCH + up, -t)
    m.chart()
    for c in range(4):
        rows = [[], []]
        for x, bulge, lean in lines:
            first = abs(x) - half
            low, high = starts[c:c + 2]
            for row, t in zip(rows, (low, high)):
                t = max(t, first)
                extra = lift * max(0.0, high - t) / (high - low)
                slope = lean * wave * PI / pitch * 2
                row.append((point(x, t, bulge * wave + extra), (slope, 1.0, PITCH), (x, (t + overhang) * 1.09 + c * 0.06)))
        m.grid(rows, 1.0)
        if c == 0:
            drop = -0.07
        else:
            drop = 0.0
        m_edge = []
        for x, bulge, _ in lines:
            if abs(x) - half > starts[c]:
                continue
            t, s = starts[c], (starts[c] + overhang) * 1.09 + c * 0.06
            top = bulge * wave + lift
            low = drop - 0.02 if c == 0 else bulge * wave
            m_edge.append([(point(x, t, low), (0, 0, 1), (x, s - 0.04)), (point(x, t, top), (0, 0, 1), (x, s))])
        m.grid(m_edge, 1.0)
    scale_u, scale_v = 8 * pitch, 4 * course * 1.09
    m.uv0 = [(round(s / scale_u, 5), round(-t / scale_v, 5)) for s, t in m.st]
    return m


def shell():
    """Eave underside, and the house from outside."""
    out = []
    m = Mesh("eave soffit", "wood")
    low, high = 0.28, 0.46
    y = EAVE - 0.09
    loop_sweep(m, square(HALF_X, HALF_Z), edges([(low, 6.47), (high, y)]), 1.0, outward=False)
    out.append(m)
    walls = Mesh("outside walls", "plaster")
    top = EAVE + (OUTSIDE + 0.46) * PITCH
    loop_sweep(walls, square(HALF_X + OUTSIDE, HALF_Z + OUTSIDE), edges([(0.0, COURT_Y), (0.0, top - 0.02)]), 2.6)
    out.append(walls)
    ridge = Mesh("outside eave", "wood")
    far = ROOF_REACH - OUTSIDE
    edge = EAVE + (ROOF_REACH + 0.46) * PITCH
    loop_sweep(ridge, square(HALF_X + OUTSIDE, HALF_Z + OUTSIDE),
               edges([(0.0, top - 0.02), (far, edge - 0.1), (far, edge)]), 1.0)
    out.append(ridge)
    return out

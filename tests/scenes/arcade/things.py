"""What stands, hangs and grows in the court."""
import math
import random

from mesh import Mesh, cross, scaled, unit
from shapes import PI, arc, ball, cap, curve, edges, lathe, loop_sweep, regular, sphere_run


def fountain():
    """An octagonal basin, a baluster with a bowl; the water is another mesh."""
    stone = Mesh("fountain", "stone")
    outer = edges([(0.14, 0.0), (0.14, 0.12), (0.05, 0.16), (0.05, 0.44)]) + [curve(0.05, 0.44, 0.12, 0.5, "up", 4)]
    outer += edges([(0.12, 0.5), (0.12, 0.58), (-0.16, 0.58), (-0.16, 0.1)])
    loop_sweep(stone, regular(8, 1.5, PI / 8), outer, 1.3)
    inner = regular(8, 1.5 - 0.16 / math.cos(PI / 8), PI / 8)
    cap(stone, inner, 0.1, True, 1.3)
    lathe(stone, [[(0.30, 0.1), (0.30, 0.22)], curve(0.30, 0.22, 0.17, 0.34, "up", 4),
                  [(0.17, 0.34), (0.13, 0.5), (0.14, 0.66), (0.2, 0.8), (0.17, 0.92), (0.1, 0.98), (0.12, 1.04)]], 24, 1.3)
    lathe(stone, [[(0.12, 1.04), (0.3, 1.07), (0.52, 1.16), (0.66, 1.27)], [(0.66, 1.27), (0.68, 1.31)],
                  [(0.68, 1.31), (0.63, 1.31)], [(0.63, 1.31), (0.5, 1.22), (0.3, 1.16), (0.1, 1.14)]], 32, 1.3)
    lathe(stone, [[(0.1, 1.14), (0.1, 1.3)], [(0.1, 1.3), (0.075, 1.36), (0.07, 1.5)], [(0.07, 1.5), (0.12, 1.54)],
                  [(0.12, 1.54), (0.12, 1.58)]], 16, 1.3)
    cap(stone, regular(16, 0.12), 1.58)
    water = Mesh("water", "water")
    cap(water, inner, 0.47)
    bowl = Mesh("bowl water", "water")
    cap(bowl, regular(32, 0.598), 1.27)
    return [stone, water, bowl]


def ring(mesh, radius, width, thick, tilt, spin, centre):
    """A flat metal hoop, its axis tilted about x and then turned about y."""
    profile = [(-width, -thick), (width, -thick), (width, thick), (-width, thick), (-width, -thick)]

    def turned(p):
        x, y, z = p
        y, z = y * math.cos(tilt) - z * math.sin(tilt), y * math.sin(tilt) + z * math.cos(tilt)
        return (x * math.cos(spin) + z * math.sin(spin), y, -x * math.sin(spin) + z * math.cos(spin))
    for (h0, r0), (h1, r1) in zip(profile, profile[1:]):
        mesh.chart()
        size = math.hypot(h1 - h0, r1 - r0)
        nh, nr = (r1 - r0) / size, -(h1 - h0) / size
        rows = []
        for h, r, s in ((h0, r0, 0.0), (h1, r1, size)):
            row = []
            for t in arc(48, 0.0, 2 * PI):
                p = turned(((radius + r) * math.cos(t), h, (radius + r) * math.sin(t)))
                n = turned((nr * math.cos(t), nh, nr * math.sin(t)))
                row.append(((p[0] + centre[0], p[1] + centre[1], p[2] + centre[2]), n, (radius * t, s)))
            rows.append(row)
        mesh.grid(rows)


def armillary():
    """Polished bronze on the fountain: a ball in three hoops."""
    m = Mesh("armillary", "bronze")
    centre = (0.0, 2.02, 0.0)
    ball(m, 0.17, 8, 32, centre)
    lathe(m, [[(0.03, 1.58), (0.03, 1.6)], [(0.06, 1.6), (0.025, 1.68), (0.018, 1.852)]], 16)
    ring(m, 0.40, 0.022, 0.008, PI / 2, 0.5, centre)
    ring(m, 0.37, 0.022, 0.008, 0.41, 0.0, centre)
    ring(m, 0.34, 0.018, 0.008, PI / 2, 0.5 + PI / 2, centre)
    return m


def pot():
    m = Mesh("pot", "terracotta")
    lathe(m, [[(0.24, 0.0), (0.29, 0.2), (0.345, 0.5)], [(0.345, 0.5), (0.385, 0.5)],
              [(0.385, 0.5), (0.395, 0.54), (0.385, 0.58)],
              [(0.385, 0.58), (0.325, 0.58)], [(0.325, 0.58), (0.31, 0.5)]], 24, 0.8)
    soil = Mesh("soil", "soil")
    lathe(soil, [[(0.312, 0.5), (0.0, 0.53)]], 24, 0.8, pole="last")
    return [m, soil]


def card(m, p, side, up, half):
    """The square p +- half side +- half up with the whole texture."""
    n = cross(side, up)
    corners = [tuple(p[i] + side[i] * a * half + up[i] * b * half for i in range(3))
               for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    m.chart()
    v = [m.vertex(c, n, uv, uv) for c, uv in zip(corners, ((0, 1), (1, 1), (1, 0), (0, 0)))]
    m.triangle(v[0], v[1], v[2])
    m.triangle(v[0], v[2], v[3])


def cards(m, rng, count, centre, radius, size, squash=1.0, inner=0.25):
    """Leaf cards about a ball, leaning outward."""
    for _ in range(count):
        while True:
            d = (rng.random() * 2 - 1, rng.random() * 2 - 1, rng.random() * 2 - 1)
            length = math.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2)
            if 0.1 < length <= 1:
                break
        far = radius * (inner + (1 - inner) * length)
        out = scaled(d, 1 / length)
        p = (centre[0] + out[0] * far, centre[1] + out[1] * far * squash, centre[2] + out[2] * far)
        n = unit((out[0] + (rng.random() - 0.5) * 1.3, out[1] + 0.35 + (rng.random() - 0.5) * 1.3,
                  out[2] + (rng.random() - 0.5) * 1.3))
        side = unit(cross(n, (rng.random() - 0.5, rng.random() - 0.5, rng.random() - 0.5)))
        up = cross(n, side)
        h = size * (0.85 + 0.3 * rng.random()) / 2
        card(m, p, side, up, h)


def orange_tree(seed):
    rng = random.Random(seed)
    trunk = Mesh("trunk %d" % seed, "bark")
    lathe(trunk, [[(0.05, 0.5), (0.04, 0.9), (0.035, 1.6), (0.02, 2.1)]], 10, 0.5)
    crown = Mesh("crown %d" % seed, "leaves", authored=False)
    cards(crown, rng, 92, (0.0, 1.95, 0.0), 0.70, 0.56, 0.9)
    fruit = Mesh("oranges %d" % seed, "orange")
    for _ in range(9):
        a, h = rng.random() * 2 * PI, rng.random()
        r = 0.72 * math.sqrt(1 - (0.9 * h - 0.6) ** 2)
        ball(fruit, 0.045, 3, 10, (r * math.cos(a), 1.95 + 0.62 * (0.9 * h - 0.6), r * math.sin(a)))
    return [trunk, crown, fruit]


def bush(seed):
    m = Mesh("bush %d" % seed, "leaves", authored=False)
    cards(m, random.Random(seed), 30, (0.0, 0.72, 0.0), 0.36, 0.42, 0.8, 0.1)
    return m


def vine(name, seed):
    """A climber: round a column (whose axis is the origin) and out over the wall above it, 0.2 in front."""
    rng = random.Random(seed)
    m = Mesh(name, "leaves", authored=False)
    for i in range(64):
        h = 0.15 + 3.75 * rng.random()
        if h < 2.75:
            a = 2 * PI * rng.random()
            p, n = (0.26 * math.cos(a), h, 0.26 * math.sin(a)), (math.cos(a), 0.3, math.sin(a))
        else:
            p = ((rng.random() - 0.5) * (0.5 + 1.5 * max(0.0, h - 3.1)), h, 0.32 + 0.08 * rng.random())
            n = (0.0, 0.3 + 0.4 * rng.random(), 1.0)
        n = unit((n[0] + (rng.random() - 0.5) * 0.8, n[1], n[2] + (rng.random() - 0.5) * 0.4))
        side = unit(cross((rng.random() - 0.5, 1.0, 0.0), n))
        card(m, p, side, cross(n, side), 0.16 + 0.05 * rng.random())
    return m


def bench():
    """A stone seat on two legs; no lightmap coordinates of its own."""
    m = Mesh("bench", "stone", authored=False)
    m.box((-0.8, 0.42, -0.21), (0.8, 0.5, 0.21), "", 1.3)
    for x in (-0.58, 0.58):
        m.box((x - 0.08, 0.0, -0.16), (x + 0.08, 0.42, 0.16), "bt", 1.3)
    return m


def lantern():
    """Hangs from y = 0 down; a frame of iron, glass panes, a glowing mantle."""
    iron = Mesh("lantern", "iron", authored=False)
    lathe(iron, [[(0.008, -0.62), (0.008, 0.0)]], 6)
    lathe(iron, [[(0.06, -0.012), (0.06, 0.0)]], 12)
    cap(iron, regular(12, 0.06), -0.012, False)
    roof = [(0.0, 0.11), (0.03, 0.1), (0.05, 0.06), (0.15, 0.0)]
    lathe(iron, [[(r, y - 0.72) for r, y in reversed(roof)]], 6)
    cap(iron, regular(6, 0.15), -0.72, False)
    lathe(iron, [[(0.1, -1.07), (0.1, -1.045)]], 6)
    cap(iron, regular(6, 0.1), -1.07, False)
    cap(iron, regular(6, 0.1), -1.045)
    for i in range(6):
        a = 2 * PI * i / 6
        x0, z0, x1, z1 = 0.094 * math.cos(a), 0.094 * math.sin(a), 0.128 * math.cos(a), 0.128 * math.sin(a)
        bar = 0.006
        for k in range(4):
            b0, b1 = PI / 2 * k + PI / 4, PI / 2 * (k + 1) + PI / 4
            p = [(bar * 1.4 * math.cos(b), bar * 1.4 * math.sin(b)) for b in (b0, b1)]
            n = (math.cos((b0 + b1) / 2), 0.0, math.sin((b0 + b1) / 2))
            iron.chart()
            iron.grid([[((x + q[0], y, z + q[1]), n, (s, y)) for s, q in enumerate(p)]
                       for x, y, z in ((x0, -1.045, z0), (x1, -0.722, z1))])
    glass = Mesh("lantern glass", "glass", authored=False)
    lathe(glass, [[(0.09, -1.044), (0.122, -0.724)]], 6)
    flame = Mesh("flame", "flame", authored=False)
    ball(flame, 0.035, 4, 12, (0.0, -0.84, 0.0))
    return [iron, glass, flame]


def sign_board():
    """A lit board on the wall: the front carries the sign, the sides are wood."""
    w, h, d = 1.2, 0.45, 0.1
    y = 5.2
    front = Mesh("sign", "sign")
    front.quad((-w, y - h, d), (w, y - h, d), (w, y + h, d), (-w, y + h, d))
    front.uv0 = [(0, 1), (1, 1), (1, 0), (0, 0)]
    frame = Mesh("sign frame", "iron")
    frame.box((-w, y - h, 0.0), (w, y + h, d), "kf")
    return [front, frame]

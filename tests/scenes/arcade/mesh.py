"""A mesh in the making: patches with normals, texture coordinates in metres and unrolled charts.

Every value is rounded before it is stored, so that the last bits of a machine's libm do not show.
"""
import math


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return scaled(a, 1.0 / length) if length > 0 else (0.0, 1.0, 0.0)


class Mesh:
    """One glTF mesh of one primitive. authored: it gets TEXCOORD_1 made from its charts."""

    def __init__(self, name, material, authored=True):
        self.name, self.material, self.authored = name, material, authored
        self.positions, self.normals, self.uv0, self.st, self.triangles = [], [], [], [], []
        self.charts = []  # first vertex of each
        self.uv1 = None

    def chart(self):
        """The patches that follow share a chart (give them matching st) until the next call."""
        self.charts.append(len(self.positions))

    def vertex(self, p, n, uv, st):
        self.positions.append(tuple(round(c, 5) + 0.0 for c in p))
        self.normals.append(tuple(round(c, 5) + 0.0 for c in unit(n)))
        self.uv0.append((round(uv[0], 5) + 0.0, round(uv[1], 5) + 0.0))
        self.st.append((st[0], st[1]))
        return len(self.positions) - 1

    def triangle(self, a, b, c):
        """Turned so that its front is the side of the normals; left out when it has no area."""
        p = self.positions
        n = cross(sub(p[b], p[a]), sub(p[c], p[a]))
        if dot(n, n) < 1e-14:
            return
        facing = dot(n, add(add(self.normals[a], self.normals[b]), self.normals[c]))
        self.triangles.append((a, b, c) if facing >= 0 else (a, c, b))

    def grid(self, rows, tile=1.0, turn=False):
        """rows of (position, normal, (s, t)); s and t in metres; tile: metres of one texture repeat."""
        index = []
        for row in rows:
            index.append([])
            for p, n, st in row:
                uv = (st[1] / tile, -st[0] / tile) if turn else (st[0] / tile, -st[1] / tile)
                index[-1].append(self.vertex(p, n, uv, st))
        for i in range(len(index) - 1):
            for j in range(len(index[i]) - 1):
                a, b, c, d = index[i][j], index[i][j + 1], index[i + 1][j + 1], index[i + 1][j]
                self.triangle(a, b, c)
                self.triangle(a, c, d)

    def quad(self, a, b, c, d, tile=1.0, st=None):
        """A flat face a, b, c, d seen anticlockwise from its front; its own chart unless st is given."""
        n = unit(cross(sub(b, a), sub(d, a)))
        if st is None:
            self.chart()
            w = math.sqrt(dot(sub(b, a), sub(b, a)))
            h = math.sqrt(dot(sub(d, a), sub(d, a)))
            st = ((0, 0), (w, 0), (w, h), (0, h))
        v = [self.vertex(p, n, (s[0] / tile, -s[1] / tile), s) for p, s in zip((a, b, c, d), st)]
        self.triangle(v[0], v[1], v[2])
        self.triangle(v[0], v[2], v[3])

    def box(self, low, high, leave_out="", tile=1.0):
        """leave_out: faces not made, of the letters l r (x), b t (y), k f (z: back, front)."""
        (x0, y0, z0), (x1, y1, z1) = low, high
        faces = {
            "l": ((x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)),
            "r": ((x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)),
            "b": ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
            "t": ((x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)),
            "k": ((x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)),
            "f": ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
        }
        for key, corners in faces.items():
            if key not in leave_out:
                self.quad(*corners, tile=tile)

    def finish(self):
        """Lays the charts out on shelves and makes TEXCOORD_1 of them."""
        if not self.authored:
            return self
        bounds = self.charts + [len(self.positions)]
        assert bounds[0] == 0, self.name
        boxes = []
        for i in range(len(bounds) - 1):
            part = self.st[bounds[i]:bounds[i + 1]]
            if not part:
                continue
            s0, t0 = min(s for s, _ in part), min(t for _, t in part)
            w, h = max(s for s, _ in part) - s0, max(t for _, t in part) - t0
            lie = w < h  # the longer side across
            boxes.append((round(min(w, h), 6), round(max(w, h), 6), i, s0, t0, lie))
        margin = 0.012 * math.sqrt(sum((h + 0.02) * (w + 0.02) for h, w, *_ in boxes)) + 0.01
        width = max(max(b[1] for b in boxes), math.sqrt(sum((h + margin) * (w + margin) for h, w, *_ in boxes)))
        place, x, y, shelf = {}, 0.0, 0.0, 0.0
        for h, w, i, s0, t0, lie in sorted(boxes, key=lambda b: (-b[0], -b[1], b[2])):
            if x > 0 and x + w > width + 1e-9:
                x, y, shelf = 0.0, y + shelf + margin, 0.0
            place[i] = (x, y, s0, t0, lie)
            x += w + margin
            shelf = max(shelf, h)
        size = max(width, y + shelf) + 2 * margin
        self.uv1 = []
        for i in range(len(bounds) - 1):
            for s, t in self.st[bounds[i]:bounds[i + 1]]:
                x, y, s0, t0, lie = place[i]
                u, v = (t - t0, s - s0) if lie else (s - s0, t - t0)
                self.uv1.append((round((x + u + margin) / size, 6), round((y + v + margin) / size, 6)))
        return self

"""Tileable pictures drawn texel by texel, and the two image formats they are stored in.

Only exact arithmetic and square roots are used, so every machine draws the same bytes; the files are written
without a compressor for the same reason.
"""
import math
import random
import struct
import zlib


def png(width, height, channels, data):
    """8-bit PNG of stored deflate blocks."""
    stride = width * channels
    raw = b"".join(b"\0" + bytes(data[y * stride:(y + 1) * stride]) for y in range(height))
    blocks = bytearray(b"\x78\x01")
    for at in range(0, len(raw), 65535):
        piece = raw[at:at + 65535]
        blocks += struct.pack("<BHH", at + 65535 >= len(raw), len(piece), len(piece) ^ 0xffff) + piece
    blocks += struct.pack(">I", zlib.adler32(raw))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", bytes(blocks)) + chunk(b"IEND", b"")


def rgbe(width, height, texels):
    """Radiance picture of (r, g, b) floats, scan-lines coded as literal runs."""
    out = bytearray(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
    for y in range(height):
        planes = [bytearray(), bytearray(), bytearray(), bytearray()]
        for r, g, b in texels[y * width:(y + 1) * width]:
            exponent = math.frexp(max(r, g, b, 1e-9))[1]
            scale = math.ldexp(256.0, -exponent)
            for plane, value in zip(planes, (r * scale, g * scale, b * scale, exponent + 128)):
                plane.append(min(255, int(value)))
        out += struct.pack(">BBH", 2, 2, width)
        for plane in planes:
            for at in range(0, width, 128):
                piece = plane[at:at + 128]
                out += bytes([len(piece)]) + piece
    return bytes(out)


class Noise:
    """Smooth tileable value noise in -1..1, octaves of doubling frequency and halving weight."""

    def __init__(self, size, cells, octaves, seed, stretch=1):
        rng = random.Random(seed)
        self.size, self.layers = size, []
        weight, total = 1.0, 0.0
        for _ in range(octaves):
            across, down = cells * stretch, cells
            lattice = [[rng.random() * 2 - 1 for _ in range(across)] for _ in range(down)]
            self.layers.append((weight, lattice, self.steps(size, across), self.steps(size, down)))
            total += weight
            cells, weight = cells * 2, weight * 0.5
        self.scale = 1.6 / total

    @staticmethod
    def steps(size, cells):
        out = []
        for i in range(size):
            x = (i + 0.5) * cells / size
            k = int(x)
            f = x - k
            out.append((k % cells, (k + 1) % cells, f * f * (3 - 2 * f)))
        return out

    def row(self, y):
        values = [0.0] * self.size
        for weight, lattice, xs, ys in self.layers:
            y0, y1, fy = ys[y]
            a, b = lattice[y0], lattice[y1]
            line = [(p + (q - p) * fy) * weight for p, q in zip(a, b)]
            for x, (x0, x1, fx) in enumerate(xs):
                values[x] += line[x0] + (line[x1] - line[x0]) * fx
        return [v * self.scale for v in values]


def shade(color, amount):
    """The colour made lighter or darker: amount is relative."""
    return tuple(max(0, min(255, int(c * (1.0 + amount) + 0.5))) for c in color)


def mix(a, b, t):
    return tuple(p + (q - p) * t for p, q in zip(a, b))


def masonry(size, rows, color, joint, seed, joint_px=2.0, tone=0.07, grain=0.05):
    """Courses of blocks. rows: a list of (height share, list of block end positions 0..1)."""
    rng = random.Random(seed)
    fine, coarse = Noise(size, 32, 3, seed + 1), Noise(size, 5, 3, seed + 2)
    tops, blocks, at = [], [], 0.0
    for share, ends in rows:
        tops.append((at * size, (at + share) * size))
        blocks.append([(e * size, rng.random() * 2 - 1, rng.random() * 2 - 1) for e in ends])
        at += share
    data = bytearray()
    for y in range(size):
        k = max(i for i, (top, _) in enumerate(tops) if top <= y + 0.5)
        dy = min(y + 0.5 - tops[k][0], tops[k][1] - y - 0.5)
        f, c = fine.row(y), coarse.row(y)
        ends = blocks[k]
        for x in range(size):
            i = 0
            while i < len(ends) and ends[i][0] <= x + 0.5:
                i += 1
            right = ends[i] if i < len(ends) else (ends[0][0] + size, ends[0][1], ends[0][2])
            left = ends[i - 1][0] if i > 0 else ends[-1][0] - size
            d = min(dy, x + 0.5 - left, right[0] - x - 0.5)
            edge = min(1.0, max(0.0, (d - joint_px * 0.5) / joint_px))
            face = shade(mix(color, (color[0], color[1] * 0.97, color[2] * 0.9), right[2]),
                         right[1] * tone + f[x] * grain + c[x] * grain)
            data += bytes(shade(mix(joint, face, edge), 0.0))
    return png(size, size, 3, data)


def ashlar(size=512):
    ends = [[0.25, 0.75], [0.04, 0.5], [0.31, 0.75], [0.0, 0.52]]
    return masonry(size, [(0.25, e) for e in ends], (213, 196, 164), (158, 143, 118), 11)


def flags(size=512):
    rows = [(0.22, [0.1, 0.37, 0.7]), (0.28, [0.25, 0.62, 0.9]), (0.2, [0.15, 0.45, 0.8]), (0.3, [0.33, 0.6, 0.98])]
    return masonry(size, rows, (196, 184, 162), (138, 127, 110), 23, tone=0.09)


def tiles(size=256):
    """A chequered floor of 4 x 4 tiles."""
    rng = random.Random(31)
    tone = [[rng.random() * 2 - 1 for _ in range(4)] for _ in range(4)]
    fine, data = Noise(size, 16, 3, 32), bytearray()
    for y in range(size):
        f = fine.row(y)
        for x in range(size):
            i, j = x * 4 // size, y * 4 // size
            d = min((x + 0.5) * 4 / size - i, i + 1 - (x + 0.5) * 4 / size, (y + 0.5) * 4 / size - j, j + 1 - (y + 0.5) * 4 / size)
            color = (190, 117, 82) if (i + j) % 2 else (222, 206, 176)
            edge = min(1.0, max(0.0, (d - 0.012) / 0.02))
            data += bytes(shade(mix((150, 132, 112), shade(color, tone[j][i] * 0.06 + f[x] * 0.06), edge), 0.0))
    return png(size, size, 3, data)


def plaster(size=256):
    coarse, fine, data = Noise(size, 3, 4, 41), Noise(size, 48, 2, 42), bytearray()
    for y in range(size):
        c, f = coarse.row(y), fine.row(y)
        for x in range(size):
            data += bytes(shade((238, 236, 232), c[x] * 0.05 + f[x] * 0.02 - 0.02))
    return png(size, size, 3, data)


def roof(size=256):
    """8 tiles across, 4 courses down."""
    rng = random.Random(51)
    tone = [[rng.random() * 2 - 1 for _ in range(8)] for _ in range(4)]
    fine, data = Noise(size, 24, 3, 52), bytearray()
    for y in range(size):
        f, v = fine.row(y), (y + 0.5) * 4 / size
        j = int(v)
        lip = max(0.0, 1.0 - (v - j) * 9)  # the shadow below the course above
        for x in range(size):
            i = x * 8 // size
            data += bytes(shade(mix((193, 108, 70), (205, 142, 98), 0.5 + 0.5 * tone[j][i]),
                                tone[j][(i * 3 + 1) % 8] * 0.10 + f[x] * 0.08 - lip * 0.35))
    return png(size, size, 3, data)


def wood(size=256):
    """6 upright planks."""
    grain, data = Noise(size, 4, 4, 61, stretch=12), bytearray()
    rng = random.Random(62)
    tone = [rng.random() * 2 - 1 for _ in range(6)]
    for y in range(size):
        g = grain.row(y)
        for x in range(size):
            u = (x + 0.5) * 6 / size
            i = int(u)
            seam = max(0.0, 1.0 - min(u - i, i + 1 - u) * 22)
            data += bytes(shade((140, 92, 56), tone[i] * 0.08 + g[x] * 0.16 - seam * 0.5))
    return png(size, size, 3, data)


def shutter(size=256):
    """Two leaves of slats with frames."""
    fine, data = Noise(size, 24, 2, 71), bytearray()
    for y in range(size):
        f, v = fine.row(y), (y + 0.5) / size
        slat = v * 24 - int(v * 24)
        for x in range(size):
            u = (x + 0.5) / size * 2
            u -= int(u)
            frame = u < 0.10 or u > 0.90 or v < 0.05 or v > 0.95 or abs(v - 0.5) < 0.03
            light = (0.06 if frame else 0.12 - slat * 0.45) - (0.5 if u < 0.02 or u > 0.98 else 0.0)
            data += bytes(shade((92, 128, 112), light + f[x] * 0.05))
    return png(size, size, 3, data)


def leaves(size=256):
    """A spray of leaves on nothing: alpha cuts them out. Colours are carried into the empty texels."""
    rng = random.Random(81)
    base = (74, 112, 48)
    color = [base] * (size * size)
    alpha = bytearray(size * size)
    for k in range(46):
        cx, cy = (0.5 + (rng.random() - 0.5) * 0.74) * size, (0.5 + (rng.random() - 0.5) * 0.74) * size
        dx, dy = rng.random() * 2 - 1, rng.random() * 2 - 1
        norm = math.sqrt(dx * dx + dy * dy) + 1e-6
        dx, dy = dx / norm, dy / norm
        long, wide = (0.085 + 0.035 * rng.random()) * size, (0.036 + 0.012 * rng.random()) * size
        leaf = shade(mix((58, 98, 40), (118, 150, 62), rng.random()), (rng.random() - 0.5) * 0.2)
        for y in range(max(0, int(cy - long)), min(size, int(cy + long) + 1)):
            for x in range(max(0, int(cx - long)), min(size, int(cx + long) + 1)):
                a, b = (x - cx) * dx + (y - cy) * dy, (y - cy) * dx - (x - cx) * dy
                t = a / long
                if abs(t) < 1 and abs(b) < wide * (1 - t * t):
                    color[y * size + x] = shade(leaf, -0.22 if abs(b) < 1.0 else 0.1 * b / wide)
                    alpha[y * size + x] = 255
    return png(size, size, 4, b"".join(bytes(c) + bytes([a]) for c, a in zip(color, alpha)))


def strokes(width, height, lines, radius):
    """Distance to the nearest stroke, in units of radius; lines of (x0, y0, x1, y1) in pixels."""
    field = [9.0] * (width * height)
    reach = int(radius * 5)
    for x0, y0, x1, y1 in lines:
        dx, dy = x1 - x0, y1 - y0
        for y in range(max(0, int(min(y0, y1)) - reach), min(height, int(max(y0, y1)) + reach)):
            for x in range(max(0, int(min(x0, x1)) - reach), min(width, int(max(x0, x1)) + reach)):
                t = max(0.0, min(1.0, ((x + 0.5 - x0) * dx + (y + 0.5 - y0) * dy) / (dx * dx + dy * dy)))
                px, py = x + 0.5 - x0 - dx * t, y + 0.5 - y0 - dy * t
                field[y * width + x] = min(field[y * width + x], math.sqrt(px * px + py * py) / radius)
    return field


def sign(width=512, height=192):
    """KILN and a flame in neon on a dark board: the emission picture."""
    letters = {"K": [(0, 0, 0, 6), (4, 0, 0, 3.4), (1.2, 2.6, 4, 6)], "I": [(0, 0, 0, 6)],
               "L": [(0, 0, 0, 6), (0, 6, 3.4, 6)], "N": [(0, 6, 0, 0), (0, 0, 4, 6), (4, 6, 4, 0)]}
    lines, at, unit = [], 168.0, 16.5
    for letter, advance in (("K", 6.2), ("I", 2.4), ("L", 5.2), ("N", 5)):
        lines += [(at + a * unit, 46 + b * unit, at + c * unit, 46 + d * unit) for a, b, c, d in letters[letter]]
        at += advance * unit
    flame = [(84, 150), (56, 128), (54, 100), (72, 76), (80, 40), (98, 68), (104, 62), (116, 96), (112, 130), (84, 150)]
    inner = [(84, 136), (74, 122), (86, 98), (96, 122), (84, 136)]
    white = strokes(width, height, lines, 6.0)
    red = strokes(width, height, [p + q for p, q in zip(flame, flame[1:])] + [p + q for p, q in zip(inner, inner[1:])], 5.0)
    border = strokes(width, height, [(16, 16, 496, 16), (496, 16, 496, 176), (496, 176, 16, 176), (16, 176, 16, 16)], 2.5)
    data = bytearray()
    for w, r, b in zip(white, red, border):
        c = [20.0, 8.0, 8.0]
        for field, tint in ((w, (255, 226, 170)), (r, (255, 110, 48)), (b, (255, 150, 80))):
            core = 1.0 if field < 1 else max(0.0, 1.0 - (field - 1) * 1.5)
            glow = 0.4 / (1 + field * field) if field < 5 else 0.0
            for i in range(3):
                c[i] += tint[i] * max(core, glow)
        data += bytes(min(255, int(v)) for v in c)
    return png(width, height, 3, data)


def sky(to_sun, width=512, height=256):
    """A late afternoon without the sun's disc: blue overhead, a warm horizon, thin high cloud, the glow around
    the sun, and below the horizon the light of the land."""
    cloud = Noise(width, 6, 4, 91)
    # Directions from exact arithmetic: a rational walk round the circle would not do, so cosines are rounded.
    across = [(round(math.cos(t), 7), round(math.sin(t), 7))
              for t in ((2 * math.pi * ((x + 0.5) / width - 0.5)) for x in range(width))]
    texels = []
    for y in range(height):
        t = math.pi * (y + 0.5) / height
        up, out = round(math.cos(t), 7), round(math.sin(t), 7)
        c = cloud.row(y * 2 % width)
        for x, (cx, cz) in enumerate(across):
            d = (out * cx, up, out * cz)
            toward = d[0] * to_sun[0] + d[1] * to_sun[1] + d[2] * to_sun[2]
            warm = max(0.0, 0.5 + 0.5 * toward)
            if up < 0:
                k = 0.36 + 0.14 * warm
                texels.append((k * 1.0, k * 0.86, k * 0.66))
                continue
            low = (1 - up) * (1 - up) * (1 - up)
            low *= low
            veil = max(0.0, min(1.0, c[x] * 0.9 + 0.05)) * min(1.0, up * 3) * 0.55
            glow = warm * warm
            glow = glow * glow
            halo = glow * glow * glow * 1.6 + glow * 0.35
            rgb = mix((0.52, 0.86, 1.55), (1.75, 1.56, 1.36), min(1.0, low * 1.1))
            rgb = mix(rgb, (1.85, 1.76, 1.66), veil)
            texels.append(tuple(round(v + halo * k + low * warm * q, 5)
                                for v, k, q in zip(rgb, (1.0, 0.82, 0.56), (0.9, 0.5, 0.15))))
    return rgbe(width, height, texels)

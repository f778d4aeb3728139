"""8-bit PNG pictures without packages: read, shrink by a whole factor, write."""
import struct
import zlib


def read(path):
    """(width, height, channels, bytes) of a picture of 8 bits a channel that is not interlaced."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR":
            head = struct.unpack_from(">IIBBBBB", data, at + 8)
        elif kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    width, height, bits, colour, _, _, interlaced = head
    if bits != 8 or interlaced or colour not in (0, 2, 6):
        raise ValueError("%s: grey, RGB or RGBA of 8 bits is wanted" % path)
    channels = {0: 1, 2: 3, 6: 4}[colour]
    return width, height, channels, unfilter(zlib.decompress(packed), width * channels, height, channels)


def unfilter(raw, stride, height, step):
    out, above = bytearray(), bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride if kind else 0):
            left, up = (row[i - step] if i >= step else 0), above[i]
            corner = above[i - step] if i >= step else 0
            if kind == 4:
                p = left + up - corner
                near = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
            else:
                near = (0, left, up, (left + up) // 2)[kind]
            row[i] = (row[i] + near) & 255
        out += row
        above = row
    return bytes(out)


def shrunk(picture, factor):
    width, height, channels, data = picture
    w, h = width // factor, height // factor
    out = bytearray(w * h * 3)
    for y in range(h):
        for x in range(w):
            for c in range(3):
                source = c if channels > 1 else 0
                total = sum(data[((y * factor + j) * width + x * factor + i) * channels + source]
                            for j in range(factor) for i in range(factor))
                out[(y * w + x) * 3 + c] = total // (factor * factor)
    return w, h, 3, bytes(out)


def write(path, picture):
    width, height, _, data = picture
    raw = b"".join(b"\0" + data[y * width * 3:(y + 1) * width * 3] for y in range(height))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))

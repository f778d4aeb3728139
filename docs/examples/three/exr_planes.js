// Reads scan-line OpenEXR files, uncompressed, ZIPS or ZIP, with all channels by name: three's EXRLoader reads only
// R, G, B, A and Y, while a bake's masters have layers (L1x.G). Values are floats; row 0 is the top row.

const FLOAT = 2, HALF = 1;
const LINES_OF = { 0: 1, 2: 1, 3: 16 };  // lines per chunk, by compression: none, ZIPS, ZIP

class Cursor {
  constructor(buffer) { this.view = new DataView(buffer); this.at = 0; }
  int() { this.at += 4; return this.view.getInt32(this.at - 4, true); }
  text() {
    let out = '';
    for (let c; (c = this.view.getUint8(this.at++)) !== 0;) out += String.fromCharCode(c);
    return out;
  }
}

function readHeader(cursor) {
  if (cursor.int() !== 20000630) throw new Error('it is not an OpenEXR file');
  if (cursor.int() & 0x1a00) throw new Error('tiles, deep data and several parts are not read');
  const header = { channels: [] };
  for (let name; (name = cursor.text()) !== '';) {
    const type = cursor.text(), size = cursor.int(), next = cursor.at + size;
    if (type === 'chlist') {
      for (let channel; (channel = cursor.text()) !== '';) {
        header.channels.push({ name: channel, type: cursor.int() });
        cursor.at += 12;
      }
    } else if (name === 'dataWindow') {
      const [x0, y0, x1, y1] = [cursor.int(), cursor.int(), cursor.int(), cursor.int()];
      Object.assign(header, { y0, width: x1 - x0 + 1, height: y1 - y0 + 1 });
    } else if (name === 'compression') {
      header.compression = cursor.view.getUint8(cursor.at);
    }
    cursor.at = next;
  }
  if (!(header.compression in LINES_OF)) throw new Error(`compression ${header.compression} is not read`);
  for (const channel of header.channels)
    if (channel.type !== FLOAT && channel.type !== HALF) throw new Error(`channel ${channel.name} holds integers`);
  return header;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// OpenEXR's ZIP filter: bytes are split into even and odd ones, then replaced by differences.
function unfilter(bytes) {
  for (let i = 1; i < bytes.length; ++i) bytes[i] = bytes[i - 1] + bytes[i] - 128;
  const out = new Uint8Array(bytes.length), half = (bytes.length + 1) >> 1;
  for (let i = 0; i < bytes.length; ++i) out[i] = bytes[(i & 1 ? half : 0) + (i >> 1)];
  return out;
}

function half(bits) {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -14 * (fraction / 1024));
}

// Returns {width, height, planes: {name: Float32Array}}.
export async function readExrPlanes(buffer) {
  const cursor = new Cursor(buffer), header = readHeader(cursor);
  const { width, height, channels } = header, lines = LINES_OF[header.compression];
  const planes = {};
  for (const { name } of channels) planes[name] = new Float32Array(width * height);
  const lineBytes = channels.reduce((sum, c) => sum + width * (c.type === FLOAT ? 4 : 2), 0);
  const chunks = [];
  for (let c = 0; c < Math.ceil(height / lines); ++c) {
    chunks.push(Number(cursor.view.getBigUint64(cursor.at, true)));
    cursor.at += 8;
  }
  await Promise.all(chunks.map(async (offset) => {
    const first = cursor.view.getInt32(offset, true) - header.y0, size = cursor.view.getInt32(offset + 4, true);
    const count = Math.min(lines, height - first), raw = count * lineBytes;
    let bytes = new Uint8Array(buffer, offset + 8, size);
    if (size < raw) bytes = unfilter(await inflate(bytes));
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = 0;
    for (let y = first; y < first + count; ++y)
      for (const { name, type } of channels)
        for (let x = 0; x < width; ++x) {
          planes[name][y * width + x] = type === FLOAT ? view.getFloat32(at, true) : half(view.getUint16(at, true));
          at += type === FLOAT ? 4 : 2;
        }
  }));
  return { width, height, planes };
}

// Probe volumes of a bake (docs/probes.md) for three.js: light for what moves.
//
//   const probes = await KilnProbes.load('out/');   // probes.json, probes.exr and, with visibility, probes_distance.exr
//   const lamp = new THREE.LightProbe();
//   scene.add(lamp);
//   probes.update(lamp, ball.position);              // in every frame, for the object in question
//
// A LightProbe lights all of a scene: put each moving object on a layer of its own, or give its material the
// coefficients. query_harmonics() of common/probes/query.h is the same in C++; the tests compare both.
import { readExrPlanes } from './exr_planes.js';

const NAMES = ['L00', 'L1m1', 'L10', 'L11', 'L2m2', 'L2m1', 'L20', 'L21', 'L22'];
const LEAST_WEIGHT = 1e-6, CRUSH = 0.2, INACTIVE = 2;

async function fetchOrThrow(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  return response;
}

export class KilnProbes {
  // `folder` ends with a slash. `get(url)`: what fetches a file; returns a Response.
  static async load(folder, get = fetchOrThrow) {
    const layout = await (await get(folder + 'probes.json')).json();
    if (layout.version !== 1) throw new Error(`probes.json is of version ${layout.version}; this loader reads 1`);
    const light = await readExrPlanes(await (await get(folder + 'probes.exr')).arrayBuffer());
    const seen = layout.volumes.some((v) => v.visibility) &&
      await readExrPlanes(await (await get(folder + 'probes_distance.exr')).arrayBuffer());
    return new KilnProbes(layout, light, seen);
  }

  constructor(layout, light, distances) {
    this.volumes = [...layout.volumes].sort((a, b) => a.spacing - b.spacing);
    this.count = layout.probes;
    this.columns = layout.columns;
    this.planes = light.planes;
    this.distances = distances || null;
    this.side = layout.distance_side;
    this.coefficients = NAMES.map((name) => ['R', 'G', 'B'].map((channel) => light.planes[`${name}.${channel}`]));
  }

  // Nine RGB coefficients of radiance around a point, [r, g, b, r, g, b, ...], and how much of them is known: 1 inside
  // of volumes, 0 where no probe has light. `position`: {x, y, z} in the bake's world. `visibility`: false asks as if
  // every probe saw everything.
  light(position, visibility = true) {
    const out = new Float64Array(27);
    let left = 1;
    for (const volume of this.volumes) {
      const { list, inside } = this.#weights(volume, position, visibility);
      for (const [probe, weight] of list)
        for (let k = 0; k < 9; ++k)
          for (let c = 0; c < 3; ++c) out[3 * k + c] += left * inside * weight * this.coefficients[k][c][probe];
      left *= 1 - inside;
    }
    if (left < 1) for (let i = 0; i < 27; ++i) out[i] /= 1 - left;
    return { coefficients: out, known: 1 - left };
  }

  // Sets a THREE.LightProbe to the light around a point.
  update(lightProbe, position) {
    const { coefficients, known } = this.light(position);
    lightProbe.sh.coefficients.forEach((c, k) => c.fromArray(coefficients, 3 * k));
    lightProbe.intensity = known > 0 ? 1 : 0;
  }

  #weights(volume, position, visibility) {
    const p = [position.x, position.y, position.z];
    const root = 3 * 2 ** (volume.levels - 1), end = volume.roots.map((n) => n * root);
    const at = p.map((x, k) => (x - volume.min[k]) / volume.spacing);
    const clamped = at.map((x, k) => Math.min(Math.max(x, 0), end[k]));
    const off = Math.hypot(...at.map((x, k) => x - clamped[k])) / 2 ** (volume.levels - 1);
    const list = [];
    if (!(off < 1)) return { list, inside: 0 };
    let index = this.#find(volume, clamped, root), sum = 0, left = 1;
    for (;;) {
      const brick = volume.bricks[index], isRoot = brick.parent === index;
      const own = isRoot ? 1 : this.#fade(brick, clamped);
      if (own > 0 && this.#addCell(volume.visibility && visibility, brick, clamped, p, left * own, list)) {
        sum += left * own;
        left *= 1 - own;
      }
      if (isRoot || !(left > 0)) break;
      index = brick.parent;
    }
    for (const entry of list) entry[1] /= sum;
    return { list, inside: sum > 0 ? 1 - off : 0 };
  }

  #find(volume, at, root) {
    const cell = at.map((x, k) => Math.min(Math.floor(x / root), volume.roots[k] - 1));
    let index = cell[0] + volume.roots[0] * (cell[1] + volume.roots[1] * cell[2]);
    for (let children; (children = volume.bricks[index].children) !== 0;) {
      const first = volume.bricks[children], size = 3 * 2 ** first.level;
      index = children;
      for (let k = 0; k < 3; ++k) if (at[k] >= first.corner[k] + size) index += 1 << k;
    }
    return index;
  }

  // 0 at a neighbour of larger spacing, 1 from one cell off.
  #fade(brick, at) {
    let nearest = 1;
    const cell = 2 ** brick.level;
    for (let side = 0; side < 27 && brick.coarser; ++side) {
      if (!(brick.coarser >> side & 1)) continue;
      const step = [side % 3 - 1, Math.floor(side / 3) % 3 - 1, Math.floor(side / 9) - 1];
      let away = 0;
      for (let k = 0; k < 3; ++k) {
        const low = (at[k] - brick.corner[k]) / cell;
        if (step[k] < 0) away = Math.max(away, low);
        if (step[k] > 0) away = Math.max(away, 3 - low);
      }
      nearest = Math.min(nearest, away);
    }
    return Math.max(nearest, 0);
  }

  // Adds the probes of a cell with weights that add up to `share`; false if none of them has light.
  #addCell(visibility, brick, at, position, share, list) {
    const first = [], part = [], begin = list.length;
    for (let k = 0; k < 3; ++k) {
      const local = Math.min(Math.max((at[k] - brick.corner[k]) / 2 ** brick.level, 0), 3);
      first[k] = Math.min(Math.floor(local), 2);
      part[k] = local - first[k];
    }
    let sum = 0;
    for (let corner = 0; corner < 8; ++corner) {
      let weight = 1, place = 0;
      for (let k = 0, stride = 1; k < 3; ++k, stride *= 4) {
        const upper = corner >> k & 1;
        weight *= upper ? part[k] : 1 - part[k];
        place += (first[k] + upper) * stride;
      }
      const probe = brick.probes[place];
      if (!(weight > 0) || this.planes.state[probe] === INACTIVE) continue;
      if (visibility && this.distances) weight *= this.#crush(this.#sees(probe, position));
      list.push([probe, weight]);
      sum += weight;
    }
    for (let i = begin; i < list.length; ++i) list[i][1] *= share / sum;
    return list.length > begin;
  }

  #crush(weight) {
    const w = Math.max(LEAST_WEIGHT, weight);
    return w < CRUSH ? w * w * w / (CRUSH * CRUSH) : w;
  }

  // Chebyshev's bound of the share of distances beyond, cubed.
  #sees(probe, position) {
    const at = ['X', 'Y', 'Z'].map((axis) => this.planes[`position.${axis}`][probe]);
    const d = position.map((x, k) => x - at[k]), r = Math.hypot(...d);
    if (!(r > 0)) return 1;
    const [mean, square] = this.#distance(probe, d.map((x) => x / r));
    if (!(r > mean)) return 1;
    const variance = Math.abs(square - mean * mean), beyond = r - mean;
    return (variance / (variance + beyond * beyond)) ** 3;
  }

  #distance(probe, [x, y, z]) {
    const sum = Math.abs(x) + Math.abs(y) + Math.abs(z);
    let u = x / sum, v = y / sum;
    if (z < 0) [u, v] = [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
    const s = (0.5 * u + 0.5) * this.side + 0.5, t = (0.5 * v + 0.5) * this.side + 0.5;
    const column = Math.floor(s), row = Math.floor(t), fs = s - column, ft = t - row, tile = this.side + 2;
    const corner = (Math.floor(probe / this.columns) * tile + row) * this.distances.width + probe % this.columns * tile + column;
    return ['mean', 'square'].map((name) => {
      const map = this.distances.planes[name], below = corner + this.distances.width;
      return (map[corner] * (1 - fs) + map[corner + 1] * fs) * (1 - ft) + (map[below] * (1 - fs) + map[below + 1] * fs) * ft;
    });
  }
}

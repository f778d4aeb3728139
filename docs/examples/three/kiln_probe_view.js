// Shows the probes of a bake: each as a ball lit by its own harmonics, a ball to drag through them, and a slice through
// the light that they give. All are of a grey of 0.5, as the view "irradiance" shows surfaces.
import * as THREE from 'three';
import { KilnProbes } from './kiln_probes.js';
import { VIEW } from './kiln_material.js';
import { fetchOrThrow } from './kiln_maps.js';
import { probeLitMaterial, probeShader } from './kiln_probe_material.js';

const MANY = 4000;  // from here on balls have fewer triangles
const MOVED = 0xff9a1f;
const AXES = ['x', 'y', 'z'];
const LUMINANCE = [0.2126, 0.7152, 0.0722];
const MEAN_E = 0.8862269255;  // of L00: E, mean over all normals

// SH9 of a uniform; the same numbers as kiln_probe_irradiance.
const HARMONIC_E = /* glsl */`
uniform vec3 kilnSh[9];
vec3 kilnHarmonicE(vec3 n) {
  return max(0.8862269255 * kilnSh[0] + 1.0233267079 * (n.y * kilnSh[1] + n.z * kilnSh[2] + n.x * kilnSh[3]) +
    0.8580855308 * (n.x * n.y * kilnSh[4] + n.y * n.z * kilnSh[5] + n.x * n.z * kilnSh[7]) +
    0.2477079561 * (3.0 * n.z * n.z - 1.0) * kilnSh[6] + 0.4290427654 * (n.x * n.x - n.y * n.y) * kilnSh[8], vec3(0.0));
}`;
const GREY = 'kilnCurve(0.5 * RECIPROCAL_PI * E)';

// Of every probe, the least spacing of the bricks it is in, and the place in the grid that it belongs to.
function gridOf(probes) {
  const spacing = new Float32Array(probes.count).fill(Infinity), place = new Float32Array(3 * probes.count);
  for (const v of probes.volumes)
    for (const brick of v.bricks) {
      if (brick.children) continue;
      const cell = 2 ** brick.level;
      brick.probes.forEach((p, i) => {
        spacing[p] = Math.min(spacing[p], v.spacing * cell);
        [i & 3, i >> 2 & 3, i >> 4].forEach((step, k) => { place[3 * p + k] = v.min[k] + v.spacing * (brick.corner[k] + cell * step); });
      });
    }
  return { spacing, place };
}

function makeBalls(probes, shader, uniforms, { spacing }) {
  const from = probes.count > MANY ? new THREE.SphereGeometry(1, 10, 7) : new THREE.SphereGeometry(1, 24, 16);
  const geometry = new THREE.InstancedBufferGeometry();
  geometry.setIndex(from.index);
  geometry.setAttribute('position', from.attributes.position);
  geometry.setAttribute('kilnSpacing', new THREE.InstancedBufferAttribute(spacing, 1));
  geometry.instanceCount = probes.count;
  const material = new THREE.ShaderMaterial({
    uniforms: { ...shader.uniforms, ...uniforms, kilnSize: { value: 0 }, kilnInactive: { value: true }, kilnCut: { value: new THREE.Vector4() } },
    vertexShader: `${shader.glsl}
      attribute float kilnSpacing;
      uniform float kilnSize;
      uniform bool kilnInactive;
      uniform vec4 kilnCut;  // probes on its negative side are hidden
      varying vec3 vNormal, vAt;
      flat varying int vProbe;
      void main() {
        vProbe = gl_InstanceID;
        vec4 head = kiln_probe(kilnProbes, uint(gl_InstanceID), 0u);
        vNormal = position;
        vAt = head.xyz + position * (kilnSize * kilnSpacing);
        bool hidden = (head.w > 1.5 && !kilnInactive) || dot(head.xyz, kilnCut.xyz) + kilnCut.w < 0.0;
        gl_Position = hidden ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * viewMatrix * vec4(vAt, 1.0);
      }`,
    fragmentShader: `#include <common>
      ${shader.glsl}\n${VIEW}
      varying vec3 vNormal, vAt;
      flat varying int vProbe;
      void main() {
        vec3 n = normalize(vNormal);
        float state = kiln_probe(kilnProbes, uint(vProbe), 0u).w, facing = abs(dot(n, normalize(cameraPosition - vAt)));
        vec3 E = kiln_probe_irradiance(kilnProbes, uint(vProbe), n);
        vec3 colour = ${GREY};
        if (state > 1.5) colour = kilnLinear(vec3(1.0, 0.0, 1.0) * (0.6 + 0.4 * facing));
        else if (state > 0.5 && facing < 0.55) colour = kilnLinear(vec3(1.0, 0.604, 0.122));
        gl_FragColor = vec4(colour, 1.0);
        #include <colorspace_fragment>
      }` });
  const balls = new THREE.Mesh(geometry, material);
  balls.frustumCulled = false;
  return balls;
}

// From where the grid has them to where they are.
function makeMoves(probes, { place }) {
  const points = [];
  for (let i = 0; i < probes.count; ++i)
    if (probes.planes.state[i] === 1)
      points.push(place[3 * i], place[3 * i + 1], place[3 * i + 2], ...['X', 'Y', 'Z'].map((axis) => probes.planes[`position.${axis}`][i]));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: MOVED }));
}

function makeBall(uniforms, radius) {
  const material = new THREE.ShaderMaterial({
    uniforms: { ...uniforms, kilnSh: { value: Array.from({ length: 9 }, () => new THREE.Vector3()) } },
    vertexShader: 'varying vec3 vNormal;\nvoid main() { vNormal = normal; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: `#include <common>
      ${VIEW}\n${HARMONIC_E}
      varying vec3 vNormal;
      void main() {
        vec3 E = kilnHarmonicE(normalize(vNormal));
        gl_FragColor = vec4(${GREY}, 1.0);
        #include <colorspace_fragment>
      }` });
  return new THREE.Mesh(new THREE.SphereGeometry(radius, 96, 64), material);
}

function makeSlice(shader, uniforms) {
  const material = new THREE.ShaderMaterial({
    side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,  // lines are in the same plane
    uniforms: { ...shader.uniforms, ...uniforms, kilnShows: { value: 0 } },
    vertexShader: 'varying vec3 vAt;\nvoid main() { vAt = (modelMatrix * vec4(position, 1.0)).xyz; gl_Position = projectionMatrix * viewMatrix * vec4(vAt, 1.0); }',
    fragmentShader: `#include <common>
      ${shader.glsl}\n${VIEW}
      uniform int kilnShows;  // light, light without visibility, leaks
      varying vec3 vAt;
      const vec3 kWeights = vec3(${LUMINANCE});
      void main() {
        vec4 seen = kilnProbesAt(vAt, vec3(0.0), kilnShows != 1);
        if (!(seen.a > 0.0)) discard;
        vec3 E = seen.rgb, colour = ${GREY};
        if (kilnShows == 2) {
          // By which share of the larger one light changes without visibility; 2 % of white count as nothing.
          float with = dot(E, kWeights), without = dot(kilnProbesAt(vAt, vec3(0.0), false).rgb, kWeights);
          float d = (without - with) / max(max(with, without), 0.02 * 2.0 * PI / kilnExposure), m = 2.0 * abs(d);
          vec3 none = vec3(0.17), half_way = d > 0.0 ? vec3(0.85, 0.25, 0.1) : vec3(0.15, 0.35, 0.85);
          vec3 all = d > 0.0 ? vec3(1.0, 0.9, 0.35) : vec3(0.6, 0.9, 1.0);
          colour = kilnLinear(m < 1.0 ? mix(none, half_way, m) : mix(half_way, all, m - 1.0));
        }
        gl_FragColor = vec4(colour, 1.0);
        #include <colorspace_fragment>
      }` });
  return new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
}

// Where the scene's triangles meet a plane `axis` = `at`, as ribbons in the plane: dark ones below, light ones above.
function sectionOf(scene, axis, at, width) {
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3], ends = [], corner = [0, 1, 2].map(() => new THREE.Vector3());
  const matrix = new THREE.Matrix4();
  const triangle = () => {
    const hits = [];
    for (let k = 0; k < 3; ++k) {
      const a = corner[k], b = corner[(k + 1) % 3], da = a.getComponent(axis) - at, db = b.getComponent(axis) - at;
      if (da < 0 === db < 0) continue;
      const t = da / (da - db);
      hits.push([u, v].map((c) => a.getComponent(c) + t * (b.getComponent(c) - a.getComponent(c))));
    }
    if (hits.length === 2) ends.push(hits);
  };
  scene.traverse((mesh) => {
    if (!mesh.isMesh || !mesh.visible) return;
    const { position } = mesh.geometry.attributes, { index } = mesh.geometry, count = index ? index.count : position.count;
    for (let i = 0; i < (mesh.isInstancedMesh ? mesh.count : 1); ++i) {
      matrix.copy(mesh.matrixWorld);
      if (mesh.isInstancedMesh) {
        const own = new THREE.Matrix4();
        mesh.getMatrixAt(i, own);
        matrix.multiply(own);
      }
      for (let t = 0; t + 2 < count; t += 3) {
        for (let k = 0; k < 3; ++k) corner[k].fromBufferAttribute(position, index ? index.getX(t + k) : t + k).applyMatrix4(matrix);
        triangle();
      }
    }
  });
  const points = [], colours = [];
  for (const [half, colour] of [[width, 0.02], [0.4 * width, 0.9]])
    for (const [a, b] of ends) {
      const d = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(...d) || 1, s = [d[0] / length * half, d[1] / length * half];
      const corners = [[a[0] - s[0] - s[1], a[1] - s[1] + s[0]], [a[0] - s[0] + s[1], a[1] - s[1] - s[0]],
                       [b[0] + s[0] + s[1], b[1] + s[1] - s[0]], [b[0] + s[0] - s[1], b[1] + s[1] + s[0]]];
      for (const c of [0, 1, 2, 0, 2, 3]) {
        const point = [0, 0, 0];
        [point[axis], point[u], point[v]] = [at, ...corners[c]];
        points.push(...point);
        colours.push(colour, colour, colour);
      }
    }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
  return geometry;
}

// What is shown, by `state`: {probes: 'off' | 'shown' | 'through', inactive, size, ball, slice: '' | 'x' | 'y' | 'z',
// at, shows: 'light' | 'blind' | 'leaks'}; numbers are metres, but size, which is a share of the spacing.
export class ProbeView {
  // Reads nothing yet. `uniforms`: of curves and exposure.
  constructor(folder, scene, renderer, uniforms) {
    Object.assign(this, { folder, scene, renderer, uniforms, data: null });
    this.state = { probes: 'off', inactive: true, size: 0.06, ball: false, slice: '', at: 0, shows: 'light' };
  }

  async load() {
    const [probes, text] = await Promise.all([KilnProbes.load(this.folder),
      fetchOrThrow(new URL('../../shaders/kiln_probes.glsl', import.meta.url)).then((r) => r.text())]);
    this.shader = probeShader(probes, text, this.renderer);
    const grid = gridOf(probes);
    this.bounds = new THREE.Box3();
    for (const v of probes.volumes)
      this.bounds.union(new THREE.Box3(new THREE.Vector3(...v.min), new THREE.Vector3(...v.max)));
    this.visibility = probes.volumes.some((v) => v.visibility) && !!probes.distances;
    this.diagonal = this.bounds.getSize(new THREE.Vector3()).length();
    this.balls = makeBalls(probes, this.shader, this.uniforms, grid);
    this.moves = makeMoves(probes, grid);
    this.ball = makeBall(this.uniforms, Math.max(0.25 * probes.volumes[0].spacing, 0.008 * this.diagonal));
    this.slice = makeSlice(this.shader, this.uniforms);
    this.lines = new THREE.Mesh(new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide, depthWrite: false }));
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1;
    this.front = new THREE.Scene();
    this.front.add(this.balls, this.moves, this.ball);
    this.plane = new THREE.Scene();
    this.plane.add(this.slice, this.lines);
    this.data = probes;
  }

  // Factor at which the median probe's light on a grey of 0.5 is mid grey: for scenes without a lightmap.
  get exposure() {
    const { count, coefficients, planes } = this.data, light = [];
    for (let i = 0; i < count; ++i) {
      const l = coefficients[0].reduce((sum, plane, c) => sum + LUMINANCE[c] * plane[i], 0);
      if (planes.state[i] !== 2 && l > 0) light.push(0.5 / Math.PI * MEAN_E * l);
    }
    light.sort((a, b) => a - b);
    if (!light.length) return 1;
    const at = (q) => light[Math.floor(q * (light.length - 1))], middle = 0.22 / at(0.5);
    return Math.min(Math.max(1.4 / at(0.95), 0.25 * middle), middle);
  }

  // Lights the scene's surfaces by the probes.
  lightScene(exposed) {
    const made = new Map();
    this.scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const { material } = mesh;
      if (!made.has(material))
        made.set(material, material.isMeshBasicMaterial ? exposed(material) : probeLitMaterial(material, this.shader, this.uniforms));
      mesh.material = made.get(material);
    });
  }

  // Puts the ball to the probe with light that is nearest to a point.
  placeBallNear(point) {
    const { count, planes } = this.data, at = ['X', 'Y', 'Z'].map((axis) => planes[`position.${axis}`]);
    let best = -1, least = Infinity;
    for (let i = 0; i < count; ++i) {
      const d = Math.hypot(at[0][i] - point.x, at[1][i] - point.y, at[2][i] - point.z);
      if (planes.state[i] !== 2 && d < least) [best, least] = [i, d];
    }
    if (best >= 0) this.ball.position.set(at[0][best], at[1][best], at[2][best]);
  }

  // Mean E at the ball, luminance: [with visibility, without].
  lightAtBall() {
    return [true, false].map((visibility) => {
      const { coefficients } = this.data.light(this.ball.position, visibility);
      return MEAN_E * LUMINANCE.reduce((sum, w, c) => sum + w * coefficients[c], 0);
    });
  }

  get shown() {
    const { state } = this;
    return state.probes !== 'off' || state.ball || state.slice !== '';
  }

  // Before and after the scene is drawn.
  begin(camera) {
    this.renderer.clippingPlanes = [];
    if (!this.data || !this.state.slice) return;
    const axis = AXES.indexOf(this.state.slice), side = camera.position.getComponent(axis) > this.state.at ? -1 : 1;
    const normal = new THREE.Vector3().setComponent(axis, side);
    this.cut = new THREE.Plane(normal, -side * this.state.at);
    this.renderer.clippingPlanes = [this.cut];  // what is in front of the slice is cut away
  }

  end(camera) {
    this.renderer.clippingPlanes = [];
    if (!this.data || !this.shown) return;
    const { state, renderer } = this;
    renderer.autoClear = false;
    if (state.slice) {
      this.#turnSlice();
      renderer.render(this.plane, camera);
    }
    const u = this.balls.material.uniforms;
    u.kilnSize.value = state.size;
    u.kilnInactive.value = state.inactive;
    if (state.slice) u.kilnCut.value.set(...this.cut.normal.toArray(), this.cut.constant);
    else u.kilnCut.value.set(0, 0, 0, 1);
    this.balls.visible = state.probes !== 'off';
    this.moves.visible = this.balls.visible && !state.slice;
    this.ball.visible = state.ball;
    if (state.ball) {
      const { coefficients } = this.data.light(this.ball.position);
      this.ball.material.uniforms.kilnSh.value.forEach((v, k) => v.fromArray(coefficients, 3 * k));
    }
    if (state.probes === 'through') renderer.clearDepth();
    renderer.render(this.front, camera);
    renderer.autoClear = true;
  }

  #turnSlice() {
    const axis = AXES.indexOf(this.state.slice), { at } = this.state;
    this.slice.material.uniforms.kilnShows.value = ['light', 'blind', 'leaks'].indexOf(this.state.shows);
    if (this.turned === `${axis} ${at}`) return;
    this.turned = `${axis} ${at}`;
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3], size = this.bounds.getSize(new THREE.Vector3());
    const centre = this.bounds.getCenter(new THREE.Vector3()).setComponent(axis, at);
    const columns = [u, v, axis].map((k, i) => new THREE.Vector3().setComponent(k, i < 2 ? size.getComponent(k) : 1));
    this.slice.matrixAutoUpdate = false;
    this.slice.matrix.makeBasis(...columns).setPosition(centre);
    this.slice.matrixWorldNeedsUpdate = true;
    this.lines.geometry.dispose();
    this.lines.geometry = sectionOf(this.scene, axis, at, 0.0016 * this.diagonal);
  }
}

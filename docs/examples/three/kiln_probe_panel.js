// The controls of a ProbeView: panel, keys, query, and the mouse that drags the ball.
import * as THREE from 'three';

const PROBES = ['off', 'shown', 'through'], SLICES = ['', 'x', 'y', 'z'], SHOWS = ['light', 'blind', 'leaks'];
const SHOWN = { light: 'mean E, on a grey of 0.5', blind: 'the same, as if probes saw through walls',
                leaks: 'what visibility changes' };
const byId = (id) => document.getElementById(id);
const next = (list, value) => list[(list.indexOf(value) + 1) % list.length];
const number = (x) => (x === 0 ? '0' : x >= 100 ? x.toFixed(0) : x.toPrecision(3));

// `described`: KILN_probes at the root of scene.glb.
export class ProbePanel {
  constructor(view, described, { camera, controls, canvas }, redraw) {
    Object.assign(this, { view, camera, controls, canvas, redraw, loading: null, ready: false });
    byId('probes').classList.remove('hidden');
    byId('probe-count').textContent = `${described.probes} in ${described.volumes} volume${described.volumes === 1 ? '' : 's'}`;
    const { state } = view;
    const bind = (id, name, property = 'value', event = 'onchange') => {
      byId(id)[event] = () => this.set({ [name]: property === 'checked' ? byId(id).checked : byId(id).type === 'range' ? +byId(id).value : byId(id).value });
    };
    bind('probe-balls', 'probes');
    bind('probe-inactive', 'inactive', 'checked');
    bind('probe-size', 'size', 'value', 'oninput');
    bind('probe-ball', 'ball', 'checked');
    bind('probe-slice', 'slice');
    bind('probe-at', 'at', 'value', 'oninput');
    bind('probe-shows', 'shows');
    addEventListener('keydown', (event) => {
      if (event.target !== document.body || event.ctrlKey || event.metaKey) return;
      const key = event.key.toLowerCase();
      if (key === 'p') this.set({ probes: next(PROBES, state.probes) });
      else if (key === 'i') this.set({ inactive: !state.inactive });
      else if (key === 'b') this.set({ ball: !state.ball });
      else if (key === 'c') this.set({ slice: next(SLICES, state.slice) });
      else if (key === 'v') this.set({ shows: next(this.offered, state.shows) });
    });
    this.#listenToMouse();
    this.show();
  }

  // What the query asks for: probes=shown, inactive=off, size=0.1, ball=x,y,z, slice=y:1.5, shows=leaks.
  async ask(query) {
    const wish = {};
    if (query.has('probes')) wish.probes = query.get('probes');
    if (query.has('inactive')) wish.inactive = query.get('inactive') !== 'off';
    if (query.has('size')) wish.size = +query.get('size');
    if (query.has('ball')) wish.ball = query.get('ball') !== 'off';
    if (query.has('shows')) wish.shows = query.get('shows');
    const [axis, at] = (query.get('slice') ?? '').split(':');
    wish.slice = axis;
    for (const [name, list] of [['probes', PROBES], ['slice', SLICES], ['shows', SHOWS]])
      if (name in wish && !list.includes(wish[name])) throw new Error(`there is no ${name} '${wish[name]}'`);
    await this.set(wish);
    if (at !== undefined) await this.set({ at: +at });
    const place = query.get('ball')?.split(',').map(Number);
    if (place?.length === 3) this.view.ball.position.fromArray(place);
    this.show();
  }

  // Data is read when something of it is shown first.
  async set(change) {
    const { view } = this, before = view.state.slice;
    Object.assign(view.state, change);
    if (view.shown && !this.ready) {
      byId('probe-legend').textContent = 'loading ...';
      document.documentElement.dataset.probes = 'loading';
      await (this.loading ??= this.#load());
    }
    if (this.ready && view.state.slice && view.state.slice !== before) this.#rangeOfSlice();
    this.show();
  }

  get offered() {
    return this.view.data && !this.view.visibility ? SHOWS.slice(0, 1) : SHOWS;
  }

  async #load() {
    const { camera, controls, view } = this;
    if (!view.data) await view.load();  // a scene that is lit by its probes has them
    this.ready = true;
    view.placeBallNear(camera.position.clone().lerp(controls.target, 0.5).clamp(view.bounds.min, view.bounds.max));
    if (!view.visibility) for (const option of byId('probe-shows').options) option.disabled = option.value !== 'light';
  }

  #rangeOfSlice() {
    const { bounds, state } = this.view, range = byId('probe-at'), low = bounds.min[state.slice], high = bounds.max[state.slice];
    [range.min, range.max, range.step] = [low, high, (high - low) / 400];
    state.at = this.controls.target.clone().clamp(bounds.min, bounds.max)[state.slice];
  }

  show() {
    const { state, ball } = this.view;
    byId('probe-balls').value = state.probes;
    byId('probe-slice').value = state.slice;
    byId('probe-shows').value = state.shows;
    byId('probe-at').value = state.at;
    byId('probe-size').value = state.size;
    byId('probe-inactive').checked = state.inactive;
    byId('probe-ball').checked = state.ball;
    for (const part of document.querySelectorAll('[data-with]'))
      part.classList.toggle('hidden', !part.dataset.with.split(' ').every((name) => this.#has(name)));
    const lines = [];
    if (this.ready && state.slice) lines.push(`slice ${state.slice} = ${state.at.toFixed(2)} m: ${SHOWN[state.shows]}`);
    if (this.ready && state.ball) {
      const [seen, blind] = this.view.lightAtBall(), { x, y, z } = ball.position;
      lines.push(`ball at ${[x, y, z].map((c) => c.toFixed(2)).join(', ')}: E ${number(seen)}` +
                 (this.view.visibility ? `, without visibility ${number(blind)}` : ''), 'drag it; the wheel over it moves it away');
      document.documentElement.dataset.ball = [x, y, z].join(' ');
    }
    byId('probe-legend').textContent = lines.join('\n');
    document.documentElement.dataset.probes = this.ready ? `${state.probes} ${state.slice} ${state.shows}` : 'not loaded';
    this.redraw();
  }

  #has(name) {
    const { state } = this.view;
    return { data: this.ready, probes: state.probes !== 'off', slice: state.slice !== '', leaks: state.shows === 'leaks' }[name];
  }

  #listenToMouse() {
    const { camera, view, canvas } = this;
    const caster = new THREE.Raycaster(), plane = new THREE.Plane(), offset = new THREE.Vector3(), hit = new THREE.Vector3();
    const aim = (event) => {
      const box = canvas.getBoundingClientRect();
      caster.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height), camera);
      return view.data && view.state.ball && caster.intersectObject(view.ball).length > 0;
    };
    let dragged = false;
    const on = (name, listener, options = true) => canvas.parentElement.addEventListener(name, listener, options);
    on('pointerdown', (event) => {
      if (event.target !== canvas || event.button !== 0 || !aim(event)) return;
      event.stopPropagation();  // the camera stays
      dragged = true;
      plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(hit), view.ball.position);
      caster.ray.intersectPlane(plane, hit);
      offset.subVectors(view.ball.position, hit);
      canvas.setPointerCapture(event.pointerId);
    });
    on('pointermove', (event) => {
      if (!dragged) {
        if (event.target === canvas) canvas.style.cursor = aim(event) ? 'grab' : '';
        return;
      }
      event.stopPropagation();
      aim(event);
      if (!caster.ray.intersectPlane(plane, hit)) return;
      view.ball.position.addVectors(hit, offset);
      this.show();
    });
    for (const name of ['pointerup', 'pointercancel']) on(name, () => { dragged = false; });
    on('wheel', (event) => {
      if (event.target !== canvas || !aim(event)) return;
      event.stopPropagation();
      event.preventDefault();
      view.ball.position.sub(camera.position).multiplyScalar(event.deltaY < 0 ? 1.04 : 1 / 1.04).add(camera.position);
      this.show();
    }, { capture: true, passive: false });
  }
}

// The page: camera, controls, keyboard, and the query that makes a view reproducible:
//   ?folder=/bake/&scene=scene.glb&view=lit&light=linear&encoding=masters&exposure=1&curve=srgb&ui=off
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { encodingName, loadLitScene, readable, uniformsOf } from './kiln_lightmap.js';
import { exposedMaterial } from './kiln_material.js';

const VIEWS = [['lit', ''], ['irradiance', 'on a grey of 0.5'],
  ['directions', 'where light comes from, as a colour; grey: from all sides'],
  ['validity', 'grey measured, orange pushed, yellow filled,\nblue dilated, magenta inside'],
  ['samples', 'dark few, red the most'], ['error', 'stated, of E: red is 10 % and more'],
  ['charts', 'each in its colour'], ['encode-error', 'of E against the masters: red is 5 % and more'],
  ['ao', 'ambient occlusion: white is open'], ['sky', 'share of the sky that is seen'],
  ['bent', 'bent normal times sky visibility, as a colour']];
const LIGHTS = [['normal', 'E at the surface normal'], ['linear', 'L1, linear'], ['nonlinear', 'L1, non-linear']];
// What there is to choose from; any other basis has one evaluation.
const lightsOf = ({ basis }) => (basis === 'sh_l1' ? LIGHTS
                                 : [LIGHTS[0], ...(basis ? [['linear', `the basis ${basis}`]] : [])]);

const query = new URLSearchParams(location.search);
const byId = (id) => document.getElementById(id);
const on = (name, fallback) => (query.has(name) ? query.get(name) !== 'off' : fallback);

function fail(error) {
  byId('message').textContent = error.message ?? String(error);
  document.documentElement.dataset.error = byId('message').textContent;
  throw error;
}

function makeRenderer() {
  const renderer = new THREE.WebGLRenderer({ antialias: on('antialias', true), preserveDrawingBuffer: true });
  renderer.setPixelRatio(query.has('ratio') ? Number(query.get('ratio')) : devicePixelRatio);
  renderer.toneMapping = THREE.NoToneMapping;  // the materials do it
  renderer.setClearColor(0x15171a);
  document.body.append(renderer.domElement);
  renderer.extensions.has('OES_texture_float_linear');
  return renderer;
}

// The file's first camera, or one that sees everything.
function makeCamera(scene, renderer) {
  const box = new THREE.Box3().setFromObject(scene), size = box.getSize(new THREE.Vector3()).length() || 1;
  const camera = new THREE.PerspectiveCamera(50, 1, size / 1e4, size * 10);
  const target = box.getCenter(new THREE.Vector3());
  let own;
  scene.traverse((object) => { if (object.isPerspectiveCamera) own ??= object; });
  if (own) {
    own.updateWorldMatrix(true, false);
    own.matrixWorld.decompose(camera.position, camera.quaternion, new THREE.Vector3());
    camera.fov = own.fov;
    const forward = own.getWorldDirection(new THREE.Vector3());
    target.copy(camera.position).addScaledVector(forward, Math.max(size / 20, target.sub(camera.position).dot(forward)));
  } else {
    camera.position.copy(target).add(new THREE.Vector3(0.4, 0.3, 0.8).multiplyScalar(size * 0.8));
  }
  if (query.has('eye')) camera.position.fromArray(query.get('eye').split(',').map(Number));
  if (query.has('target')) target.fromArray(query.get('target').split(',').map(Number));
  if (query.has('fov')) camera.fov = Number(query.get('fov'));
  const pose = camera.quaternion.clone();
  const controls = new OrbitControls(camera, renderer.domElement);  // points the camera at the origin
  controls.target.copy(target);
  if (own && !query.has('target') && !query.has('eye')) camera.quaternion.copy(pose);
  else controls.update();
  return { camera, controls };
}

// Switches that change materials, not uniforms: textures and normal maps.
function applySwitches(scene, textures, normals) {
  scene.traverse(({ material }) => {
    if (!material) return;
    const kept = material.userData.kilnKept ??= { map: material.map, emissiveMap: material.emissiveMap,
      normalMap: material.normalMap, roughnessMap: material.roughnessMap, metalnessMap: material.metalnessMap };
    for (const name of Object.keys(kept)) material[name] = (name === 'normalMap' ? normals : textures) ? kept[name] : null;
    material.needsUpdate = true;
  });
}

// Views of the quantities that were baked.
function viewsOf({ description, byProbes }) {
  if (byProbes) return VIEWS.slice(0, 2);
  const responses = new Set((description.responses ?? []).map((r) => r.name));
  const light = ['irradiance', 'directions', 'error', 'encode-error'];
  return VIEWS.filter(([name]) => (['ao', 'sky', 'bent'].includes(name) ? responses.has(name)
                                                                         : description.basis || !light.includes(name)));
}

function addControls(state, lightmap, redraw) {
  const fill = (id, entries) => entries.forEach(([value, label]) => byId(id).append(new Option(label || value, value)));
  fill('view', viewsOf(lightmap).map(([name]) => [name]));
  const lights = lightsOf(lightmap);
  fill('light', lights);
  fill('encoding', readable(lightmap.description).map((e) => [encodingName(e)]));
  for (const id of ['light', 'encoding', 'specular'])
    byId(id).parentElement.classList.toggle('hidden', !!lightmap.byProbes);
  byId('encoding').value = lightmap.encoding;
  byId('encoding').onchange = () => {  // other maps need other shaders: reload the page
    query.set('encoding', byId('encoding').value);
    location.search = query;
  };
  const show = () => {
    for (const id of ['view', 'light', 'exposure']) byId(id).value = state[id];
    for (const id of ['filmic', 'textures', 'normals', 'specular']) byId(id).checked = state[id];
    byId('legend').textContent = VIEWS.find(([name]) => name === state.view)?.[1] ?? '';
    redraw();
  };
  for (const id of ['view', 'light']) byId(id).onchange = () => { state[id] = byId(id).value; show(); };
  byId('exposure').oninput = () => { state.exposure = Number(byId('exposure').value); show(); };
  for (const id of ['filmic', 'textures', 'normals', 'specular'])
    byId(id).onchange = () => { state[id] = byId(id).checked; show(); };
  addEventListener('keydown', (event) => {
    if (event.target !== document.body || event.ctrlKey || event.metaKey) return;
    const key = event.key.toLowerCase();
    const flip = { f: 'filmic', t: 'textures', n: 'normals', s: 'specular' }[key];
    if (flip) state[flip] = !state[flip];
    else if (key === 'l') state.light = lights[(lights.findIndex(([n]) => n === state.light) + 1) % lights.length][0];
    else if (key === '[' || key === ']') state.exposure += key === '[' ? -0.25 : 0.25;
    else if (key >= '1' && key <= '9' && viewsOf(lightmap)[key - 1]) state.view = viewsOf(lightmap)[key - 1][0];
    else if (key === 'h') byId('panel').classList.toggle('hidden');
    else return;
    show();
  });
  byId('panel').classList.toggle('hidden', !on('ui', true));
  show();
}

// A scene without a lightmap, lit by its probes: their light is that of its lamps too.
function lightByProbes(scene, view) {
  const description = { encodings: [], exposure: view.exposure }, uniforms = view.uniforms;
  uniforms.kilnExposure.value = description.exposure;
  const lamps = [];
  scene.traverse((object) => { if (object.isLight) lamps.push(object); });
  for (const lamp of lamps) lamp.removeFromParent();
  view.lightScene((material) => exposedMaterial(material, { uniforms }));
  return { description, uniforms, basis: null, encoding: '', byProbes: true };
}

// What shows the probes, if the bake has any; its code is fetched then.
async function makeProbeView(folder, { scene, lightmap, probes }, renderer) {
  if (!probes) return null;
  const { ProbeView } = await import('./kiln_probe_view.js');
  return new ProbeView(folder, scene, renderer, lightmap?.uniforms ?? uniformsOf({}));
}

async function addProbePanel(view, { probes }, stage, redraw) {
  const { ProbePanel } = await import('./kiln_probe_panel.js');
  await new ProbePanel(view, probes, stage, redraw).ask(query);
}

async function main() {
  const renderer = makeRenderer();
  const folder = query.get('folder') ?? '/bake/', file = query.get('scene') ?? 'scene.glb';
  const lit = await loadLitScene(folder, file, renderer, query.get('encoding')), { scene } = lit;
  document.title = `Kiln: ${scene.name || file}`;
  const world = new THREE.Scene();
  world.add(scene);
  const probeView = await makeProbeView(folder, lit, renderer);
  if (!lit.lightmap) await probeView.load();
  const lightmap = lit.lightmap ?? lightByProbes(scene, probeView);
  const { camera, controls } = makeCamera(scene, renderer);
  const base = query.has('exposure') ? Number(query.get('exposure')) : lightmap.uniforms.kilnExposure.value;
  const plain = query.get('shading') === 'plain';  // base colour x E / pi alone, as in preview.png
  const first = lightmap.description.basis || lightmap.byProbes ? 'lit' : lightmap.description.responses[0].name;
  const state = { view: query.get('view') ?? first, exposure: 0, filmic: query.get('curve') !== 'srgb',
    light: query.get('light') ?? (lightmap.basis ? 'linear' : 'normal'), textures: on('textures', true),
    normals: on('normals', true), specular: on('specular', !!lightmap.basis) && !plain };
  if (!viewsOf(lightmap).some(([n]) => n === state.view)) throw new Error(`there is no view '${state.view}'`);
  if (!lightsOf(lightmap).some(([n]) => n === state.light)) throw new Error(`there is no light '${state.light}'`);
  let switches = '';
  let pending = false;
  const draw = () => {
    pending = false;
    const u = lightmap.uniforms;
    u.kilnView.value = VIEWS.findIndex(([n]) => n === state.view);
    u.kilnLight.value = LIGHTS.findIndex(([n]) => n === state.light);
    u.kilnExposure.value = base * 2 ** state.exposure;
    u.kilnFilmic.value = state.filmic;
    u.kilnSpecularOn.value = state.specular;
    u.kilnPlain.value = plain;
    const now = `${state.textures} ${state.normals}`;
    if (now !== switches) applySwitches(scene, state.textures, state.normals);
    switches = now;
    probeView?.begin(camera);
    renderer.render(world, camera);
    probeView?.end(camera);
  };
  const redraw = () => { if (!pending) { pending = true; requestAnimationFrame(draw); } };
  const resize = () => {
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
    renderer.setSize(innerWidth, innerHeight);
    redraw();
  };
  controls.addEventListener('change', redraw);
  addEventListener('resize', resize);
  resize();
  addControls(state, lightmap, redraw);
  if (probeView) await addProbePanel(probeView, lit, { camera, controls, canvas: renderer.domElement }, redraw);
  draw();
  document.documentElement.dataset.ready = 'true';
}

main().catch(fail);

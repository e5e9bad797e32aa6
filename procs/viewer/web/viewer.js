// Connects the page to the viewer: events tell what is new, and what is large is fetched when there is time for it.
import {kColours, MapStore} from '/map_store.js';
import {SceneView} from '/scene_view.js';
import {FramePanel, Header, PlaybackPanel, ProcessPanel, SeriesPanel} from '/panels.js';

const byId = (id) => document.getElementById(id);
const kMapEveryMs = 160, kSeriesEveryMs = 500;

const store = new MapStore();
const scene = new SceneView(byId('map'), store);
const header = new Header();
const frame = new FramePanel();
const series = new SeriesPanel();
const processes = new ProcessPanel();
const playback = new PlaybackPanel();
const seen = {poses: 0, features: 0, statuses: 0, maps: 0, errors: 0, connected: false};

function say(message) {
  byId('message').hidden = !message;
  byId('message').textContent = message;
}

/// At most one request at a time and one per `everyMs`; `wake` asks for another.
function paced(everyMs, work) {
  let wanted = false, busy = false, last = 0;
  const run = async () => {
    if (busy || !wanted) return;
    busy = true;
    wanted = false;
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, last + everyMs - performance.now())));
    last = performance.now();
    try {
      await work();
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // the connection is gone: events tell when it is back
    } finally {
      busy = false;
    }
    run();
  };
  return () => { wanted = true; run(); };
}

let told = {generation: 0, version: 0};
const wakeMap = paced(kMapEveryMs, async () => {
  if (store.generation === told.generation && store.version >= told.version) return;
  const answer = await fetch(`/api/map?generation=${store.generation}&since=${store.version}`);
  if (!answer.ok) return;
  const before = store.arrangement;
  const bytes = await answer.arrayBuffer();
  if (store.apply(bytes)) scene.update();
  if (store.arrangement !== before) moveCameras();
  seen.maps++;
});

// A camera and the map that it is in change together: a pose waits for the map that it is told in.
const waiting = new Map();  // by camera: the newest pose whose map is not there

function placeCamera(pose) {
  // A frame that waits its turn behind the first map says nothing of where the camera is.
  if (!pose.p && pose.word === 'waiting for map') return;
  if (pose.arrangement !== store.arrangement) {
    waiting.set(pose.camera, pose);
    return;
  }
  waiting.delete(pose.camera);
  scene.setPose(pose.camera, pose.p ? pose : null);
}

/// What is drawn has moved as a whole, and the cameras with it.
function moveCameras() {
  for (const camera of new Set([...scene.poses.keys(), ...store.cameras.keys()])) scene.setPose(camera, store.cameras.get(camera) || null);
  for (const pose of [...waiting.values()]) {
    if (pose.arrangement === store.arrangement) placeCamera(pose);
  }
}
const wakeSeries = paced(kSeriesEveryMs, () => series.poll());

let chosen = 0;  // the camera whose frame, curves and numbers are shown

function chooseCamera(camera) {
  chosen = scene.chosen = camera;
  header.choose(camera);
  frame.choose(camera);
  press('cameras', String(camera), 'camera');
  if (scene.mode === 'follow') scene.goBehind();
  series.choose(camera);
  wakeSeries();
}

function onStatus(status) {
  seen.statuses++;
  header.onStatus(status, status.cameras[chosen] || {});
  processes.onStatus(status);
  scene.setNumCameras(status.cameras.length);
  showCameras(status.cameras);
  showWeld(processes.newWeld(status.events));
  if (status.camera) {
    scene.aspect = status.camera.width / status.camera.height;
    scene.setUp(status.up);
    scene.setTruth(status.truth);
  }
  const waits = status.sequence ? (status.map.keyframes > 0 ? '' : 'no map yet: the camera must move') : 'waiting for a camera on the bus';
  if (seen.connected) say(waits);
  showDrawn(status);
  showLegend(status);
}

/// Which of several cameras is to be shown.
function showCameras(cameras) {
  const group = byId('cameras');
  group.hidden = cameras.length < 2;
  if (group.hidden || group.children.length === cameras.length) return;
  group.innerHTML = cameras.map((_, i) => `<button data-camera="${i}" class="p-${i % kColours}" title="show camera ${i}"><i></i>${i}</button>`).join('');
  press('cameras', String(chosen), 'camera');
}

let weldUntil = 0;
function showWeld(what) {
  if (what) weldUntil = performance.now() + 5000;
  if (what) byId('weld').textContent = what;
  byId('weld').hidden = performance.now() > weldUntil;
}

function showDrawn(status) {
  const {drawnPoints, inSight} = scene.pictures;
  const share = inSight > drawnPoints ? `${Math.round(100 * drawnPoints / inSight)} % of the landmarks in sight` : '';
  const others = status.viewer.browsers > 1 ? `${status.viewer.browsers} browsers` : '';
  byId('drawn').textContent = [share, others].filter((s) => s).join(' · ');
}

function showLegend(status) {
  const entry = (kind, name, label) => `<span><i class="${kind} c-${name}"></i>${label}</span>`;
  const aged = scene.pointMaterial.uniforms.ages.value > 0.5;
  const several = status.maps.length > 1, colourOf = (map) => map.colour % kColours;
  const only = status.maps.length === 1 ? colourOf(status.maps[0]) : 0;
  const still = several || only !== 0
      ? status.maps.map((map) => `<span class="m-${colourOf(map)}"><i class="dot"></i>${map.name}</span>`).join('') : entry('dot', 'static', 'still');
  const points = aged ? '<span>old <i class="ramp"></i> new landmarks</span>'
                      : still + entry('dot', 'unsure', 'unsure') + entry('dot', 'dynamic', 'moving');
  const path = status.cameras.length > 1
      ? status.cameras.map((_, i) => `<span class="p-${i % kColours}"><i></i>camera ${i}</span>`).join('') : entry('', 'path', 'path');
  const html = points + path + (status.truth ? entry('', 'truth', 'ground truth') : '') +
      (only === 0 ? entry('', 'keyframe', 'keyframe') : `<span class="m-${only}"><i></i>keyframe</span>`) + entry('', 'edge', 'sees the same') + (status.map.loops > 0 ? entry('', 'loop', 'loop') : '');
  if (byId('legend').dataset.html === html) return;
  byId('legend').dataset.html = html;
  byId('legend').innerHTML = html;
  byId('legend').toggleAttribute('data-many', byId('legend').children.length > 14);
}

function connect() {
  const events = new EventSource('/api/events');
  const on = (name, handle) => events.addEventListener(name, (event) => handle(JSON.parse(event.data)));
  events.addEventListener('open', () => {
    seen.connected = true;
    waiting.clear();  // of a viewer that may be gone
    say('');
    wakeSeries();
  });
  events.addEventListener('error', () => {
    seen.connected = false;
    say('no connection to the viewer; trying again');
  });
  on('status', (status) => { onStatus(status); wakeSeries(); });
  on('playback', (state) => playback.onState(state));
  on('map', (version) => { told = version; wakeMap(); });
  on('features', (features) => { seen.features++; frame.onFeatures(features); });
  on('pose', (pose) => {
    seen.poses++;
    header.onPose(pose);
    placeCamera(pose);
  });
}

// ---- What people press ---------------------------------------------------------------------------------------

function press(group, pressed, attribute) {
  for (const button of byId(group).children) {
    if (button.dataset[attribute] !== 'fit') button.setAttribute('aria-pressed', String(button.dataset[attribute] === pressed));
  }
}
function setMode(mode) {
  scene.setMode(mode);
  press('camera-mode', mode === 'fit' ? scene.mode : mode, 'mode');
}
function setColours(mode) {
  scene.setColours(mode);
  press('colour-mode', mode, 'colour');
}
function toggleLayer(name, on = !scene.layers[name]) {
  scene.setLayer(name, on);
  document.querySelector(`#layers [data-layer=${name}]`).setAttribute('aria-pressed', String(on));
}
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  localStorage.setItem('theme', theme);
  scene.applyTheme();
  series.applyTheme();
}
function setText(size) {
  document.documentElement.dataset.text = size;
  localStorage.setItem('text', size);
  scene.resize();
  series.applyTheme();
}

byId('camera-mode').addEventListener('click', (event) => event.target.dataset.mode && setMode(event.target.dataset.mode));
byId('colour-mode').addEventListener('click', (event) => event.target.dataset.colour && setColours(event.target.dataset.colour));
byId('layers').addEventListener('click', (event) => event.target.dataset.layer && toggleLayer(event.target.dataset.layer));
byId('cameras').addEventListener('click', (event) => {
  const button = event.target.closest('button');
  if (button) chooseCamera(Number(button.dataset.camera));
});
const otherTheme = () => setTheme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
const otherText = () => setText(document.documentElement.dataset.text === 'large' ? 'normal' : 'large');
byId('theme').addEventListener('click', otherTheme);
byId('larger').addEventListener('click', otherText);
document.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || ['INPUT', 'SELECT'].includes(event.target.tagName)) return;
  const actions = {1: () => setMode('orbit'), 2: () => setMode('follow'), 3: () => setMode('top'), f: () => setMode('fit'),
                   b: () => setColours('belief'), g: () => setColours('age'), t: otherTheme, l: otherText,
                   ' ': () => playback.toggle()};
  if (event.key === ' ' && event.target.tagName !== 'BUTTON') event.preventDefault();
  if (actions[event.key]) actions[event.key]();
});
window.addEventListener('error', () => seen.errors++);
window.addEventListener('unhandledrejection', () => seen.errors++);

setMode('orbit');
setColours('belief');
for (const name of Object.keys(scene.layers)) toggleLayer(name, true);
say('connecting');
connect();

/// For tests and measurements.
window.dmslam = {store, scene, header, series, frame, placeCamera, moveCameras, playback, seen, setMode, setColours, setTheme, setText, toggleLayer, chooseCamera};

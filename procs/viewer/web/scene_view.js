// The map in three dimensions. Draws only when something has changed, and only as much as this machine can draw smoothly.
import * as THREE from '/three/build/three.module.js';
import {OrbitControls} from '/three/examples/jsm/controls/OrbitControls.js';
import {kColours} from '/map_store.js';
import {WideLines} from '/wide_lines.js';

const kMinBudget = 6000, kMaxBudget = 400000, kRestBudget = 110000;
const kNearKeyframes = 130;  // where there are more, these are drawn with their edges, and all others as dots
const kMostPathPoints = 1500;
const kSlowMs = 46, kFastMs = 38, kTooSlowMs = 55;  // of a picture
const kMinSharpness = 0.625;  // of the screen's resolution, in motion, where even the fewest landmarks are too slow

const pointVertex = `
  attribute vec3 value;  // belief (above zero: believed to move), first frame, colour of the map
  uniform mediump float size;
  uniform float ages, newest, floorAt, roofAt;
  uniform vec3 low[6], still[6];
  uniform vec3 up, unsure, moving, age0, age1, age2, age3;
  varying vec3 vColour;
  void main() {
    vec4 p = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * p;
    float belief = value.x;
    int map = int(value.z + 0.5);
    float height = clamp((dot(up, position) - floorAt) / max(roofAt - floorAt, 1e-6), 0.0, 1.0);
    vec3 motion = belief > 0.0 ? mix(unsure, moving, clamp(belief * 0.7 + 0.3, 0.0, 1.0))
                               : mix(unsure, mix(low[map], still[map], height), clamp(-belief * 1.5 + 0.5, 0.0, 1.0));
    float a = clamp(value.y / max(newest, 1.0), 0.0, 1.0) * 3.0;
    vec3 age = a < 1.0 ? mix(age0, age1, a) : a < 2.0 ? mix(age1, age2, a - 1.0) : mix(age2, age3, a - 2.0);
    vColour = ages > 0.5 ? age : motion;
    gl_PointSize = size * (belief > 0.0 && ages < 0.5 ? 1.35 : 1.0);
  }`;
const pointFragment = `
  precision mediump float;
  uniform mediump float size;
  varying vec3 vColour;
  void main() {
    vec2 from = gl_PointCoord - 0.5;
    if (size > 3.0 && dot(from, from) > 0.25) discard;
    gl_FragColor = vec4(vColour, 1.0);
  }`;

function css(name) {
  return new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
}

/// Without a graphics processor smoothed edges cost more than all that is drawn.
function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl');
  const extension = gl && gl.getExtension('WEBGL_debug_renderer_info');
  return !extension || /swiftshader|llvmpipe|softpipe|software/i.test(gl.getParameter(extension.UNMASKED_RENDERER_WEBGL));
}

/// The points of a line that deviate from it by more than `tolerance` (Douglas and Peucker's way), first and last included.
function simplify(points, tolerance) {
  const keep = new Uint8Array(points.length);
  const todo = [[0, points.length - 1]];
  keep[0] = keep[points.length - 1] = 1;
  while (todo.length > 0) {
    const [from, to] = todo.pop();
    const a = points[from], d = points[to].map((x, k) => x - a[k]);
    const length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    let worst = tolerance * tolerance, at = -1;
    for (let i = from + 1; i < to; ++i) {
      const e = points[i].map((x, k) => x - a[k]);
      const along = length2 > 0 ? Math.min(1, Math.max(0, (e[0] * d[0] + e[1] * d[1] + e[2] * d[2]) / length2)) : 0;
      const off = (e[0] - along * d[0]) ** 2 + (e[1] - along * d[1]) ** 2 + (e[2] - along * d[2]) ** 2;
      if (off > worst) [worst, at] = [off, i];
    }
    if (at < 0) continue;
    keep[at] = 1;
    todo.push([from, at], [at, to]);
  }
  return points.filter((_, i) => keep[i]);
}

/// The edges of a camera's pyramid, in its own frame (x right, y down, z forward), as pairs of points.
function frustumEdges(aspect, size) {
  const w = 0.75 * size, h = w / aspect, d = size;
  const c = [[-w, -h, d], [w, -h, d], [w, h, d], [-w, h, d]];
  const o = [0, 0, 0];
  return [[o, c[0]], [o, c[1]], [o, c[2]], [o, c[3]], [c[0], c[1]], [c[1], c[2]], [c[2], c[3]], [c[3], c[0]]];
}

/// A text in a disc that faces who looks, of the same size from everywhere.
function makeLabel(text, colour, ink) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const context = canvas.getContext('2d');
  context.fillStyle = colour.getStyle();
  context.beginPath();
  context.arc(32, 32, 30, 0, 2 * Math.PI);
  context.fill();
  context.fillStyle = ink.getStyle();
  context.font = 'bold 42px sans-serif';
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillText(text, 32, 35);
  const material = new THREE.SpriteMaterial({map: new THREE.CanvasTexture(canvas), sizeAttenuation: false, depthTest: false});
  const label = new THREE.Sprite(material);
  label.scale.set(0.026, 0.026, 1);
  label.renderOrder = 7;
  return label;
}

export class SceneView {
  constructor(canvas, store) {
    this.canvas = canvas;
    this.store = store;
    const context = canvas.getContext('webgl', {antialias: !isSoftware() && window.devicePixelRatio < 1.5});
    this.renderer = new THREE.WebGLRenderer({canvas, context});
    this.scene = new THREE.Scene();
    this.root = new THREE.Group();  // turned so that the map's up is up
    this.scene.add(this.root);
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.01, 1000);
    this.camera.position.set(2, 2, 4);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.touch());
    this.controls.addEventListener('start', () => { this.automatic = false; });
    this.mode = 'orbit';
    this.automatic = true;  // shows everything until somebody takes the mouse
    this.layers = {keyframes: true, edges: true, path: true, truth: true};
    this.aspect = 4 / 3;
    this.radius = 1;
    this.depth = 1;
    this.poses = new Map();  // by camera: where it is now
    this.numCameras = 1;
    this.chosen = 0;         // the camera that is followed
    this.labels = new Map();
    this.budget = isSoftware() ? 20000 : 200000;
    this.adapted = 0;
    this.sharpness = this.drawnSharpness = 1;
    this.pictures = {times: [], drawnPoints: 0, fps: 0, count: 0};
    this.needsPicture = true;
    this.lastDrawn = this.lastCall = 0;
    this.makeObjects();
    this.applyTheme();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    requestAnimationFrame((now) => this.loop(now));
  }

  makeObjects() {
    const uniforms = {size: {value: 2.5}, ages: {value: 0}, newest: {value: 1}, up: {value: new THREE.Vector3(0, -1, 0)},
                      floorAt: {value: -1}, roofAt: {value: 1}};
    for (const name of ['low', 'still']) uniforms[name] = {value: Array.from({length: kColours}, () => new THREE.Color())};
    for (const name of ['unsure', 'moving', 'age0', 'age1', 'age2', 'age3']) uniforms[name] = {value: new THREE.Color()};
    this.pointMaterial = new THREE.ShaderMaterial({vertexShader: pointVertex, fragmentShader: pointFragment, uniforms});
    this.points = new THREE.Group();
    this.tileObjects = [];
    this.dots = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({size: 5, sizeAttenuation: false, vertexColors: THREE.VertexColors || true}));
    this.dots.frustumCulled = false;
    this.lines = {
      edges: new WideLines({width: 1.2, opacity: 0.5, order: 1}),
      loops: new WideLines({width: 3, order: 4}),
      frusta: new WideLines({width: 1.4, opacity: 0.8, order: 2}),
      path: new WideLines({width: 2.8, order: 5}),
      truth: new WideLines({width: 1.2, order: 5.5}),
      camera: new WideLines({width: 2.6, order: 6}),
    };
    this.truthGroup = new THREE.Group();
    this.truthGroup.matrixAutoUpdate = false;
    this.truthGroup.add(this.lines.truth.object);
    this.grid = new THREE.Group();
    this.root.add(this.points, this.dots, this.truthGroup);
    for (const name of ['edges', 'loops', 'frusta', 'path', 'camera']) this.root.add(this.lines[name].object);
    this.scene.add(this.grid);
  }

  applyTheme() {
    this.scene.background = css('--scene');
    const u = this.pointMaterial.uniforms;
    const names = {unsure: '--unsure', moving: '--dynamic', age0: '--age-0', age1: '--age-1', age2: '--age-2', age3: '--age-3'};
    for (const [uniform, name] of Object.entries(names)) u[uniform].value = css(name);
    const maps = Array.from({length: kColours}, (_, i) => css(i === 0 ? '--static' : `--map-${i}`));
    u.still.value = maps;
    u.low.value = maps.map((colour, i) => (i === 0 ? css('--static-low') : colour.clone().multiplyScalar(0.42)));
    for (const [line, name] of Object.entries({edges: '--edge', loops: '--loop', truth: '--truth'})) this.lines[line].setColours([css(name)]);
    this.keyframeColours = [css('--keyframe'), ...maps.slice(1)];
    this.lines.frusta.setColours(this.keyframeColours);
    this.updateKeyframes();
    this.colourCameras();
    this.gridRadius = 0;
    this.touch();
  }

  /// Of one camera the path has the colour of the map it is in, of several that of the camera.
  colourCameras() {
    const cameras = Array.from({length: kColours}, (_, i) => css(i === 0 ? '--path' : `--camera-${i}`));
    const several = this.numCameras > 1;
    this.lines.path.setColours(several ? cameras : [css('--path'), ...this.keyframeColours.slice(1)]);
    this.lines.camera.setColours(several ? cameras : [css('--camera')]);
    for (const label of this.labels.values()) this.root.remove(label);
    this.labels.clear();
    this.cameraColours = cameras;
    this.showPoses();
  }

  setNumCameras(count) {
    if (count === this.numCameras) return;
    this.numCameras = count;
    this.colourCameras();
    this.updatePath();
    this.touch();
  }

  touch() { this.needsPicture = true; }

  setLayer(name, on) {
    this.layers[name] = on;
    this.showLayers();
    this.touch();
  }

  showLayers() {
    this.lines.frusta.show(this.layers.keyframes);
    this.dots.visible = this.layers.keyframes && this.store.numKeyframes > kNearKeyframes;
    this.lines.edges.show(this.layers.edges);
    this.lines.loops.show(this.layers.edges);
    this.lines.path.show(this.layers.path);
    this.lines.truth.show(this.layers.truth && this.truthKnown === true);
  }

  setColours(mode) {
    this.pointMaterial.uniforms.ages.value = mode === 'age' ? 1 : 0;
    this.touch();
  }

  resize() {
    const box = this.canvas.parentElement.getBoundingClientRect();
    const ratio = Math.min(window.devicePixelRatio, 2) * this.drawnSharpness;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(Math.max(1, box.width), Math.max(1, box.height), false);
    this.camera.aspect = Math.max(1, box.width) / Math.max(1, box.height);
    this.camera.updateProjectionMatrix();
    const larger = document.documentElement.dataset.text === 'large' ? 1.35 : 1;
    this.pixel = ratio * larger;
    this.touch();
  }

  // ---- What the viewer says ------------------------------------------------------------------------------------

  /// The store has changed.
  update() {
    this.pointMaterial.uniforms.newest.value = this.store.newestFrame;
    this.updateTiles();
    if (this.store.keyframesDirty) this.updateKeyframes();
    if (this.store.pathDirty || this.store.keyframesDirty) this.updatePath();
    if (this.store.truthDirty) this.updateTruth();
    this.store.keyframesDirty = this.store.pathDirty = this.store.truthDirty = false;
    this.measure();
    if (this.automatic) this.fit();
    this.touch();
  }

  updateTiles() {
    const tiles = this.store.tiles;
    while (this.tileObjects.length > tiles.length) this.dropTile();
    tiles.forEach((tile, i) => {
      if (this.tileObjects[i] && this.tileObjects[i].tile !== tile) this.replaceTile(i, tile);
      if (!this.tileObjects[i]) this.replaceTile(i, tile);
      if (!tile.dirty) return;
      tile.dirty = false;
      tile.bound();
      const {positions, values} = this.tileObjects[i];
      positions.updateRange = {offset: 0, count: 3 * tile.count};
      values.updateRange = {offset: 0, count: 3 * tile.count};
      positions.needsUpdate = values.needsUpdate = true;
    });
  }

  replaceTile(i, tile) {
    if (this.tileObjects[i]) {
      this.points.remove(this.tileObjects[i].object);
      this.tileObjects[i].object.geometry.dispose();
    }
    const geometry = new THREE.BufferGeometry();
    const positions = new THREE.BufferAttribute(tile.positions, 3), values = new THREE.BufferAttribute(tile.values, 3);
    geometry.setAttribute('position', positions);
    geometry.setAttribute('value', values);
    const object = new THREE.Points(geometry, this.pointMaterial);
    object.frustumCulled = false;  // done with the level of detail
    this.points.add(object);
    tile.dirty = true;
    this.tileObjects[i] = {tile, object, positions, values};
  }

  dropTile() {
    const {object} = this.tileObjects.pop();
    this.points.remove(object);
    object.geometry.dispose();
  }

  updateKeyframes() {
    const alive = this.store.keyframes.filter((keyframe) => keyframe);
    const centres = new Float32Array(3 * alive.length), colours = new Float32Array(3 * alive.length);
    alive.forEach((keyframe, i) => {
      centres.set(keyframe.centre, 3 * i);
      this.keyframeColours[keyframe.colour].toArray(colours, 3 * i);
    });
    this.dots.geometry.dispose();
    this.dots.geometry = new THREE.BufferGeometry();
    this.dots.geometry.setAttribute('position', new THREE.BufferAttribute(centres, 3));
    this.dots.geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
    this.frustaDirty = true;
  }

  /// What was walked, without the points that lie on the line between others where there are many.
  updatePath() {
    const places = this.store.trajectory();
    const path = this.lines.path;
    const pieces = [], tones = [];
    places.forEach((point, i) => {
      const before = places[i - 1];
      if (!before || point.camera !== before.camera || point.colour !== before.colour || point.frame - before.frame > 90) {
        pieces.push([]);
        tones.push(this.numCameras > 1 ? point.camera % kColours : point.colour);
      }
      pieces[pieces.length - 1].push([...point.place]);
    });
    let drawn = pieces;
    for (let tolerance = 5e-4; drawn.reduce((sum, piece) => sum + piece.length, 0) > kMostPathPoints && tolerance < 0.02; tolerance *= 2) {
      drawn = pieces.map((piece) => simplify(piece, tolerance * this.radius));
    }
    path.start(drawn.reduce((sum, piece) => sum + piece.length, 0));
    drawn.forEach((piece, number) => {
      for (let i = 1; i < piece.length; ++i) path.add(piece[i - 1], piece[i], tones[number]);
    });
    path.finish();
    path.show(this.layers.path);
  }

  updateTruth() {
    const places = [...this.store.truth].sort((a, b) => a[0] - b[0]).map(([, point]) => point);
    const truth = this.lines.truth;
    truth.start(places.length);
    for (let i = 1; i < places.length; ++i) {
      if (places[i].camera === places[i - 1].camera) truth.add(places[i - 1].place, places[i].place);
    }
    truth.finish();
    this.showLayers();
  }

  /// How large everything is: for the sizes of what is drawn, and to fit it.
  measure() {
    this.takeSample();
    if (this.places.length === 0) return;
    const box = new THREE.Box3().setFromPoints(this.places), v = new THREE.Vector3();
    const centre = box.getCenter(new THREE.Vector3());
    const spread = this.sample.map((p) => p.distanceTo(centre)).sort((a, b) => a - b);
    const walked = box.getSize(v).length() / 2;
    const around = spread.length ? spread[Math.floor(spread.length * 0.8)] : 1;
    this.centre = centre;
    this.radius = Math.max(walked, around, 1e-3);
    const size = Math.min(0.04 * this.radius, 0.08 * this.medianDepth());
    if (!this.frustumSize || Math.abs(size / this.frustumSize - 1) > 0.15) {
      this.frustumSize = size;
      this.frustaDirty = true;
      this.showPoses();
    }
    this.controls.minDistance = this.radius * 0.01;
    this.controls.maxDistance = this.radius * 30;
    this.camera.near = this.radius * 0.004;
    this.camera.far = this.radius * 80;
    this.camera.updateProjectionMatrix();
    this.placeGrid();
  }

  /// Some landmarks and keyframes, turned so that up is up: everything about sizes is measured with them.
  takeSample() {
    const q = this.root.quaternion, frames = this.store.keyframes.filter((keyframe) => keyframe);
    const each = Math.max(1, Math.ceil(frames.length / 400));
    this.places = frames.filter((_, i) => i % each === 0).map((k) => new THREE.Vector3().fromArray(k.centre).applyQuaternion(q));
    this.sample = [];
    const perTile = Math.max(6, Math.ceil(2500 / Math.max(1, this.store.tiles.length)));
    for (const tile of this.store.tiles) {
      for (let i = 0; i < Math.min(perTile, tile.count); ++i) {
        this.sample.push(new THREE.Vector3().fromArray(tile.positions, 3 * i).applyQuaternion(q));
      }
    }
  }

  /// Of landmarks from the keyframe whose landmarks they are, roughly: tiles and keyframes of the same age.
  medianDepth() {
    const frames = this.store.keyframes, tiles = this.store.tiles;
    const depths = [];
    const v = new THREE.Vector3(), w = new THREE.Vector3();
    tiles.forEach((tile, i) => {
      if (tile.count === 0) return;
      const keyframe = frames[Math.min(frames.length - 1, Math.floor((i + 0.5) / tiles.length * frames.length))];
      if (!keyframe) return;
      w.fromArray(keyframe.centre);
      for (let k = 0; k < Math.min(15, tile.count); ++k) {
        if (tile.values[3 * k + 2] !== keyframe.colour) continue;  // of another map
        depths.push(v.fromArray(tile.positions, 3 * k).distanceTo(w));
      }
    });
    depths.sort((a, b) => a - b);
    return depths.length ? depths[Math.floor(depths.length / 2)] : this.radius;
  }

  /// Lines on the floor, which is where few landmarks are below.
  placeGrid() {
    if (this.sample.length < 20) return;
    const heights = this.sample.map((p) => p.y).sort((a, b) => a - b);
    const floor = heights[Math.floor(heights.length * 0.03)];
    const uniforms = this.pointMaterial.uniforms;
    uniforms.floorAt.value = floor;
    uniforms.roofAt.value = heights[Math.floor(heights.length * 0.9)];
    uniforms.up.value.set(0, 1, 0).applyQuaternion(this.root.quaternion.clone().conjugate());
    const centre = this.centre;
    if (!this.gridRadius || Math.abs(this.radius / this.gridRadius - 1) > 0.2) {
      this.gridRadius = this.radius;
      this.grid.children.slice().forEach((child) => { this.grid.remove(child); child.geometry.dispose(); });
      const cell = Math.pow(2, Math.round(Math.log2(this.radius / 6)));
      const half = Math.ceil(1.8 * this.radius / cell);
      this.grid.add(new THREE.GridHelper(2 * half * cell, 2 * half, css('--grid'), css('--grid')));
      this.cell = cell;
    }
    this.grid.position.set(Math.round(centre.x / this.cell) * this.cell, floor, Math.round(centre.z / this.cell) * this.cell);
  }

  /// Which way of the map is up.
  setUp(up) {
    const wanted = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(...up).normalize(), new THREE.Vector3(0, 1, 0));
    const turn = this.root.quaternion.angleTo(wanted);
    if (this.upKnown && turn < 0.03) return;
    this.root.quaternion.slerp(wanted, this.upKnown && turn < 0.5 ? 0.25 : 1);
    this.upKnown = true;
    this.touch();
  }

  /// Where the ground truth lies on the map: {rotation, translation, scale}, or null.
  setTruth(truth) {
    const said = JSON.stringify(truth);
    if (said === this.truthSaid) return;
    this.truthSaid = said;
    this.truthKnown = truth !== null;
    if (truth) {
      this.truthGroup.matrix.compose(new THREE.Vector3(...truth.translation), new THREE.Quaternion(...truth.rotation),
                                     new THREE.Vector3(truth.scale, truth.scale, truth.scale));
      this.truthGroup.matrixWorldNeedsUpdate = true;
    }
    this.showLayers();
    this.touch();
  }

  /// Where a camera is now: {p, q} world from camera, or null.
  setPose(camera, pose) {
    const before = camera === this.chosen ? this.pose : null;
    const moved = pose && before ? new THREE.Vector3(...pose.p).sub(new THREE.Vector3(...before.p)) : null;
    this.poses.set(camera, pose);
    this.showPoses();
    if (moved && this.mode === 'follow') {
      moved.applyQuaternion(this.root.quaternion);
      this.camera.position.add(moved);
      this.controls.target.add(moved);
      this.controls.update();
    }
    this.touch();
  }

  /// Where the followed camera is.
  get pose() { return this.poses.get(this.chosen) || null; }

  showPoses() {
    const lines = this.lines.camera, size = 2.4 * (this.frustumSize || 0.05);
    lines.start(8 * Math.max(1, this.poses.size));
    for (const [camera, pose] of this.poses) {
      if (pose) this.addFrustum(lines, pose.p, pose.q, size, this.numCameras > 1 ? camera % kColours : 0);
      if (this.numCameras > 1) this.showLabel(camera, pose, size);
    }
    lines.finish();
  }

  /// The camera's number above it: colours alone do not tell cameras apart for everybody.
  showLabel(camera, pose, size) {
    if (!this.labels.has(camera)) {
      const label = makeLabel(String(camera), this.cameraColours[camera % kColours], this.scene.background);
      this.labels.set(camera, label);
      this.root.add(label);
    }
    const label = this.labels.get(camera);
    label.visible = Boolean(pose);
    if (pose) label.position.set(0, -1.1 * size, 0).applyQuaternion(new THREE.Quaternion(...pose.q)).add(new THREE.Vector3(...pose.p));
  }

  addFrustum(lines, centre, rotation, size, tone) {
    const q = new THREE.Quaternion(...rotation), p = new THREE.Vector3(...centre), a = new THREE.Vector3(), b = new THREE.Vector3();
    for (const [begin, end] of frustumEdges(this.aspect, size)) {
      a.set(...begin).applyQuaternion(q).add(p);
      b.set(...end).applyQuaternion(q).add(p);
      lines.add([a.x, a.y, a.z], [b.x, b.y, b.z], tone);
    }
  }

  // ---- The eye -------------------------------------------------------------------------------------------------

  setMode(mode) {
    if (mode === 'fit') {
      this.automatic = true;
      if (this.mode === 'follow') this.mode = 'orbit';
      this.fit();
      return;
    }
    this.mode = mode;
    this.automatic = mode !== 'follow';
    if (mode === 'follow') this.goBehind();
    else this.fit();
  }

  /// A step behind and above the camera, looking where it looks.
  goBehind() {
    if (!this.pose) return;
    const q = this.root.quaternion, size = Math.max(6 * (this.frustumSize || 0.1), 0.12 * this.radius);
    const at = new THREE.Vector3(...this.pose.p).applyQuaternion(q);
    const forward = new THREE.Vector3(0, 0, 1).applyQuaternion(new THREE.Quaternion(...this.pose.q)).applyQuaternion(q);
    forward.y = 0;
    forward.normalize();
    this.camera.position.copy(at).addScaledVector(forward, -1.6 * size).add(new THREE.Vector3(0, 0.9 * size, 0));
    this.controls.target.copy(at).addScaledVector(forward, 0.8 * size);
    this.controls.update();
    this.touch();
  }

  /// From behind the first camera, a little to the side and from above, so that nearly everything is in the picture.
  fit() {
    if (!this.centre) return;
    const q = this.root.quaternion;
    const direction = new THREE.Vector3(0.55, 0.62, 0.75);
    const first = this.store.keyframes.find((keyframe) => keyframe);
    if (first) {
      const forward = new THREE.Vector3(0, 0, 1).applyQuaternion(new THREE.Quaternion(...first.rotation)).applyQuaternion(q);
      forward.y = 0;
      forward.normalize();
      const side = new THREE.Vector3(0, 1, 0).cross(forward);
      direction.set(0, 0.55, 0).addScaledVector(forward, -0.8).addScaledVector(side, -0.5);
    }
    if (this.mode === 'top') direction.set(0, 1, 0.001);
    direction.normalize();
    const {target, distance} = this.frame(direction);
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.controls.target.copy(target);
    this.controls.update();
    this.touch();
  }

  /// Where to look at, and from how far, to see all keyframes and nearly all landmarks from `direction`.
  frame(direction) {
    const right = new THREE.Vector3(0, 1, 0).cross(direction).normalize();
    const up = direction.clone().cross(right);
    const axes = [right, up, direction];
    const target = new THREE.Vector3();
    for (const axis of axes) {
      const all = this.sample.map((p) => p.dot(axis)).sort((a, b) => a - b);
      const own = this.places.map((p) => p.dot(axis));
      const low = Math.min(all.length ? all[Math.floor(0.04 * all.length)] : Infinity, ...own);
      const high = Math.max(all.length ? all[Math.floor(0.96 * (all.length - 1))] : -Infinity, ...own);
      target.addScaledVector(axis, (low + high) / 2);
    }
    const tangent = Math.tan(this.camera.fov * Math.PI / 360);
    const needs = (p) => {  // how far the eye must be for this point to be within the picture, and clear of its edges
      const [x, y, z] = axes.map((axis) => p.dot(axis) - target.dot(axis));
      return z + Math.max(Math.abs(x) / (0.92 * tangent * this.camera.aspect), Math.abs(y) / (0.78 * tangent));
    };
    const all = this.sample.map(needs).sort((a, b) => a - b);
    const distance = Math.max(all.length ? all[Math.floor(0.97 * (all.length - 1))] : 0, ...this.places.map(needs), 1e-3);
    return {target, distance};
  }

  // ---- Pictures ------------------------------------------------------------------------------------------------

  loop(now) {
    requestAnimationFrame((next) => this.loop(next));
    const since = now - this.lastCall;
    this.lastCall = now;
    if (this.drewLast) this.adapt(since);
    this.drewLast = this.needsPicture || this.turning;
    if (this.turning) this.turn(now);
    if (this.needsPicture) this.draw(now);
    else this.settle(now);
  }

  /// The budget follows what pictures cost, told by how long after one the browser can go on.
  adapt(milliseconds) {
    const {times} = this.pictures;
    times.push(milliseconds);
    if (times.length > 60) times.shift();
    this.pictures.fps = 1000 * times.length / times.reduce((a, b) => a + b, 0);
    if (++this.adapted % 5 !== 0) return;
    const recent = times.slice(-5).reduce((a, b) => a + b, 0) / Math.min(5, times.length);
    if (recent > kSlowMs) this.drawLess(recent);
    if (recent < kFastMs) this.drawMore(recent);
  }

  /// First fewer landmarks, then fewer pixels.
  drawLess(recent) {
    if (this.budget > kMinBudget) this.budget = Math.max(kMinBudget, this.budget * Math.max(0.7, 40 / recent));
    else if (recent > kTooSlowMs) this.sharpness = Math.max(kMinSharpness, this.sharpness - 0.125);
  }

  /// First all pixels again, as soon as they will not be too many at once, then more landmarks.
  drawMore(recent) {
    const sharper = Math.min(1, this.sharpness + 0.125);
    if (this.sharpness < 1) {
      if (recent * (sharper / this.sharpness) ** 2 < kFastMs) this.sharpness = sharper;
    } else if (this.pictures.drawnPoints > 0.9 * this.budget) {
      this.budget = Math.min(kMaxBudget, this.budget * 1.15);
    }
  }

  /// Once nothing moves any more, one picture with as much as can be told apart.
  settle(now) {
    if (this.settled || now - this.lastDrawn < 600) return;
    this.settled = true;
    this.draw(now, Math.max(kRestBudget, this.budget));
  }

  draw(now, budget) {
    this.needsPicture = false;
    this.pictures.count++;
    this.settled = budget !== undefined;
    this.lastDrawn = now;
    const sharpness = this.settled ? 1 : this.sharpness;
    if (sharpness !== this.drawnSharpness) {
      this.drawnSharpness = sharpness;
      this.resize();
      this.needsPicture = false;
    }
    this.root.updateMatrixWorld();
    this.camera.updateMatrixWorld();
    this.chooseDetail(budget || this.budget);
    this.chooseKeyframes();
    const {width, height} = this.canvas;
    for (const lines of Object.values(this.lines)) lines.setViewport(width, height, this.pixel, this.camera.near);
    const drawn = this.pictures.drawnPoints;
    this.pointMaterial.uniforms.size.value = (drawn > 60000 ? 1.8 : drawn > 10000 ? 2.6 : drawn > 3000 ? 3.4 : 4.2) * this.pixel;
    this.dots.material.size = 2.5 * this.pixel;
    this.renderer.render(this.scene, this.camera);
  }

  /// How many landmarks of each tile are drawn: those out of sight none, the others by the room they take.
  chooseDetail(budget) {
    const frustum = new THREE.Frustum().setFromMatrix(
        new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse));
    const sphere = new THREE.Sphere(), seen = [];
    let weights = 0, total = 0;
    for (const {tile, object} of this.tileObjects) {
      object.visible = false;
      if (tile.count === 0) continue;
      sphere.center.fromArray(tile.centre).applyMatrix4(this.root.matrixWorld);
      sphere.radius = tile.radius;
      if (!frustum.intersectsSphere(sphere)) continue;
      const distance = Math.max(0.3 * tile.radius, sphere.center.distanceTo(this.camera.position));
      const weight = Math.min(4, tile.radius / distance) + 0.02;
      weights += weight;
      total += tile.count;
      seen.push({tile, object, weight});
    }
    let drawn = 0, left = budget;
    seen.sort((a, b) => a.tile.count / a.weight - b.tile.count / b.weight);
    for (const {tile, object, weight} of seen) {
      const share = total <= budget ? tile.count : Math.min(tile.count, Math.ceil(left * weight / weights));
      weights -= weight;
      left -= share;
      object.geometry.setDrawRange(0, share);
      object.visible = share > 0;
      drawn += share;
    }
    this.pictures.drawnPoints = drawn;
    this.pictures.inSight = total;
  }

  /// Frusta and edges of the keyframes, of those nearest to the eye where there are too many for all; loops always.
  chooseKeyframes() {
    const many = this.store.numKeyframes > 2 * kNearKeyframes;
    const moved = !this.chosenFrom || this.chosenFrom.distanceTo(this.camera.position) > 0.05 * this.radius;
    if (!this.frustaDirty && !(many && moved)) return;
    this.frustaDirty = false;
    this.chosenFrom = this.camera.position.clone();
    const all = this.store.keyframes.filter((keyframe) => keyframe);
    const chosen = many ? this.nearest(all, kNearKeyframes) : all;
    const {frusta, edges, loops} = this.lines;
    frusta.start(8 * chosen.length);
    for (const keyframe of chosen) this.addFrustum(frusta, keyframe.centre, keyframe.rotation, this.frustumSize || 0.05, keyframe.colour);
    this.addLinks(edges, chosen, (kind) => kind !== 2);
    this.addLinks(loops, all, (kind) => kind === 2);
    for (const lines of [frusta, edges, loops]) lines.finish();
    this.showLayers();
  }

  nearest(keyframes, most) {
    const eye = this.camera.position.clone().applyQuaternion(this.root.quaternion.clone().conjugate()), v = new THREE.Vector3();
    const distances = keyframes.map((keyframe) => v.fromArray(keyframe.centre).distanceToSquared(eye));
    const order = [...keyframes.keys()].sort((a, b) => distances[a] - distances[b]).slice(0, most);
    return order.map((i) => keyframes[i]);
  }

  addLinks(lines, keyframes, wanted) {
    lines.start(keyframes.reduce((sum, keyframe) => sum + keyframe.links.length, 0));
    for (const keyframe of keyframes) {
      keyframe.links.forEach((slot, i) => {
        const other = this.store.keyframes[slot];
        if (other && wanted(keyframe.kinds[i])) lines.add(keyframe.centre, other.centre);
      });
    }
  }

  // ---- For measurements and tests ------------------------------------------------------------------------------

  /// Turns for ever: what moving costs.
  turn(now) {
    const angle = (now - (this.turned || now)) * 0.0004;
    this.turned = now;
    this.automatic = false;
    const offset = this.camera.position.clone().sub(this.controls.target).applyAxisAngle(new THREE.Vector3(0, 1, 0), angle);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.touch();
  }

  /// Draws these objects alone and counts the pixels that are not background: {points, frusta, dots, path, truth, camera}.
  countPixels() {
    const {points, dots, lines, grid} = this;
    const objects = {points, dots, grid, frusta: lines.frusta.object, path: lines.path.object, truth: lines.truth.object,
                     camera: lines.camera.object, edges: lines.edges.object, loops: lines.loops.object};
    const visible = Object.fromEntries(Object.entries(objects).map(([name, object]) => [name, object.visible]));
    const counts = {};
    for (const name of Object.keys(objects)) {
      for (const [other, object] of Object.entries(objects)) object.visible = other === name && visible[name];
      this.draw(performance.now(), kMaxBudget);
      counts[name] = this.countForeground();
    }
    for (const [name, object] of Object.entries(objects)) object.visible = visible[name];
    this.touch();
    return counts;
  }

  countForeground() {
    const gl = this.renderer.getContext(), {width, height} = this.canvas;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const back = this.scene.background;
    const [r, g, b] = [back.r, back.g, back.b].map((x) => Math.round(255 * x));
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      if (Math.abs(pixels[i] - r) + Math.abs(pixels[i + 1] - g) + Math.abs(pixels[i + 2] - b) > 30) count++;
    }
    return count;
  }
}

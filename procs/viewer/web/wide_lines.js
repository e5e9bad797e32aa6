// Line segments of a width in pixels: what WebGL's own lines cannot do. One quad per segment.
import * as THREE from '/three/build/three.module.js';

const vertex = `
  attribute vec3 begin, end;
  attribute vec2 corner;  // which end: 0 or 1, which side: -1 or 1
  attribute float tone;   // number of a colour
  uniform vec3 colours[6];
  uniform vec2 viewport;
  uniform mediump float width;
  uniform float near;
  varying float vAcross;
  varying vec3 vColour;
  void main() {
    vColour = colours[int(tone + 0.5)];
    vec4 a = modelViewMatrix * vec4(begin, 1.0);
    vec4 b = modelViewMatrix * vec4(end, 1.0);
    float limit = -near;
    if (a.z > limit && b.z > limit) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
    if (a.z > limit) a = mix(b, a, (limit - b.z) / (a.z - b.z));
    if (b.z > limit) b = mix(a, b, (limit - a.z) / (b.z - a.z));
    vec4 ca = projectionMatrix * a, cb = projectionMatrix * b;
    vec2 sa = ca.xy / ca.w * viewport, sb = cb.xy / cb.w * viewport;
    vec2 along = sb - sa;
    float length2 = dot(along, along);
    along = length2 > 1e-8 ? along * inversesqrt(length2) : vec2(1.0, 0.0);
    vec4 here = corner.x < 0.5 ? ca : cb;
    float broad = width + 1.0;  // a pixel to fade out in
    vAcross = corner.y * broad;
    vec2 offset = vec2(-along.y, along.x) * corner.y * broad + along * (corner.x * 2.0 - 1.0) * width * 0.45;
    here.xy += offset / viewport * here.w;
    gl_Position = here;
  }`;

const fragment = `
  precision mediump float;
  varying vec3 vColour;
  uniform float opacity;
  uniform mediump float width;
  varying float vAcross;
  void main() { gl_FragColor = vec4(vColour, opacity * clamp(0.5 * (width + 1.0 - abs(vAcross)), 0.0, 1.0)); }`;

const kMostSegments = 16000;  // what 16 bits can number

export class WideLines {
  /// `width` in CSS pixels; `order`: what is drawn later.
  constructor({width = 2, opacity = 1, order = 0} = {}) {
    this.width = width;
    this.material = new THREE.ShaderMaterial({
      vertexShader: vertex, fragmentShader: fragment, transparent: true, depthWrite: false, side: THREE.DoubleSide,
      uniforms: {
        colours: {value: Array.from({length: 6}, () => new THREE.Color())}, opacity: {value: opacity}, viewport: {value: new THREE.Vector2(1, 1)},
        width: {value: width}, near: {value: 0.01},
      },
    });
    this.capacity = 0;
    this.count = 0;
    this.object = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.object.frustumCulled = false;
    this.object.renderOrder = order;
    this.object.visible = false;
    this.shown = true;
    this.grow(64);
  }

  grow(capacity) {
    this.capacity = Math.min(capacity, kMostSegments);
    const geometry = new THREE.BufferGeometry();
    const corners = new Float32Array(8 * this.capacity), index = new Uint16Array(6 * this.capacity);
    for (let i = 0; i < this.capacity; ++i) {
      corners.set([0, -1, 0, 1, 1, 1, 1, -1], 8 * i);
      index.set([0, 1, 2, 0, 2, 3].map((k) => 4 * i + k), 6 * i);
    }
    this.begin = new THREE.BufferAttribute(new Float32Array(12 * this.capacity), 3);
    this.end = new THREE.BufferAttribute(new Float32Array(12 * this.capacity), 3);
    geometry.setAttribute('position', this.begin);
    geometry.setAttribute('begin', this.begin);
    geometry.setAttribute('end', this.end);
    this.tones = new THREE.BufferAttribute(new Float32Array(4 * this.capacity), 1);
    geometry.setAttribute('tone', this.tones);
    geometry.setAttribute('corner', new THREE.BufferAttribute(corners, 2));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    this.object.geometry.dispose();
    this.object.geometry = geometry;
  }

  /// Begins anew; then `add` each segment, in the colour of its tone, then `finish`.
  start(capacity) {
    if (capacity > this.capacity) this.grow(Math.ceil(capacity * 1.5));
    this.count = 0;
  }

  add(a, b, tone = 0) {
    if (this.count === this.capacity) return;
    this.tones.array.fill(tone, 4 * this.count, 4 * this.count + 4);
    const at = 12 * this.count++;
    for (let i = at; i < at + 12; i += 3) {
      for (let k = 0; k < 3; ++k) {
        this.begin.array[i + k] = a[k];
        this.end.array[i + k] = b[k];
      }
    }
  }

  finish() {
    for (const attribute of [this.begin, this.end]) {
      attribute.updateRange = {offset: 0, count: 12 * this.count};
      attribute.needsUpdate = true;
    }
    this.tones.updateRange = {offset: 0, count: 4 * this.count};
    this.tones.needsUpdate = true;
    this.object.geometry.setDrawRange(0, 6 * this.count);
    this.show(this.shown);
  }

  /// One for each tone; a single one is that of all.
  setColours(colours) {
    this.material.uniforms.colours.value = Array.from({length: 6}, (_, i) => colours[i] || colours[0]);
  }

  show(shown) {
    this.shown = shown;
    this.object.visible = shown && this.count > 0;
  }

  /// Pixels of the canvas, and how many of them make a CSS pixel.
  setViewport(width, height, ratio, near) {
    this.material.uniforms.viewport.value.set(width, height);
    this.material.uniforms.width.value = this.width * ratio;
    this.material.uniforms.near.value = near;
  }
}

// A mirror of the viewer's tables of what is drawn: landmarks in tiles, keyframes, path and ground truth.

const kTileSlots = 2048;
const kMagic = 0x56534d44;
const kGone = 0xffffffff;

/// Landmarks whose slots are neighbours were made one after the other, so they lie together: a tile is a place. Within a
/// tile they are kept in random order, so that the first n of them are a fair sample.
class Tile {
  constructor() {
    this.positions = new Float32Array(3 * kTileSlots);
    this.values = new Float32Array(2 * kTileSlots);  // belief, first frame
    this.slotAt = new Int32Array(kTileSlots);        // by place in the arrays
    this.placeOf = new Int32Array(kTileSlots).fill(-1);
    this.count = 0;
    this.dirty = true;
    this.centre = [0, 0, 0];
    this.radius = 0;
  }

  set(slot, x, y, z, belief, first) {
    let place = this.placeOf[slot];
    if (place < 0) {
      place = Math.floor(Math.random() * (this.count + 1));
      if (place < this.count) this.move(place, this.count);
      this.count++;
      this.placeOf[slot] = place;
      this.slotAt[place] = slot;
    }
    this.positions[3 * place] = x;
    this.positions[3 * place + 1] = y;
    this.positions[3 * place + 2] = z;
    this.values[2 * place] = belief;
    this.values[2 * place + 1] = first;
    this.dirty = true;
  }

  remove(slot) {
    const place = this.placeOf[slot];
    if (place < 0) return;
    this.placeOf[slot] = -1;
    this.count--;
    if (place < this.count) this.move(this.count, place);
    this.dirty = true;
  }

  move(from, to) {
    this.positions.copyWithin(3 * to, 3 * from, 3 * from + 3);
    this.values.copyWithin(2 * to, 2 * from, 2 * from + 2);
    this.slotAt[to] = this.slotAt[from];
    this.placeOf[this.slotAt[to]] = to;
  }

  /// A sphere around nearly all of it (a stray point must not make a tile huge).
  bound() {
    const c = [0, 0, 0];
    for (let i = 0; i < 3 * this.count; ++i) c[i % 3] += this.positions[i];
    this.centre = c.map((sum) => sum / Math.max(1, this.count));
    let squares = 0;
    for (let i = 0; i < 3 * this.count; ++i) squares += (this.positions[i] - this.centre[i % 3]) ** 2;
    this.radius = 2.2 * Math.sqrt(squares / Math.max(1, this.count)) + 1e-6;
  }
}

export class MapStore {
  constructor() {
    this.generation = 0;
    this.clear();
  }

  clear() {
    this.version = 0;
    this.tiles = [];
    this.numPoints = 0;
    this.keyframes = [];  // by slot: null or {frame, centre, rotation, links}
    this.numKeyframes = 0;
    this.path = new Map();   // by frame: [x, y, z, later]
    this.truth = new Map();  // by number: [x, y, z]
    this.newestFrame = 1;
    this.pathDirty = this.keyframesDirty = this.truthDirty = true;
  }

  /// Takes in what the viewer sent; returns whether anything changed.
  apply(buffer) {
    const u32 = new Uint32Array(buffer);
    const f32 = new Float32Array(buffer);
    if (u32[0] !== kMagic || u32[1] !== 1) throw new Error('this page and the viewer do not belong together; reload');
    const [generation, flags, version, points, keyframes, links, path, truth] = u32.slice(2, 10);
    const anew = (flags & 1) !== 0;
    if (anew) this.clear();
    this.generation = generation;
    this.version = version;
    let at = 10;
    at = this.applyPoints(u32, f32, at, points);
    at = this.applyKeyframes(u32, f32, at, keyframes, links);
    at = this.applyPath(u32, f32, at, path);
    this.applyTruth(u32, f32, at, truth);
    return anew || points + keyframes + path + truth > 0;
  }

  applyPoints(u32, f32, at, n) {
    const xyz = at + 3 * n, belief = at + 6 * n, first = at + 7 * n;
    for (let i = 0; i < n; ++i) {
      const slot = u32[at + i];
      const number = Math.floor(slot / kTileSlots);
      while (this.tiles.length <= number) this.tiles.push(new Tile());
      const tile = this.tiles[number];
      const before = tile.count;
      const b = f32[belief + i];
      if (Number.isNaN(b)) {
        tile.remove(slot % kTileSlots);
      } else {
        const p = xyz + 3 * i;
        tile.set(slot % kTileSlots, f32[p], f32[p + 1], f32[p + 2], b, u32[first + i]);
        if (u32[first + i] > this.newestFrame) this.newestFrame = u32[first + i];
      }
      this.numPoints += tile.count - before;
    }
    return at + 8 * n;
  }

  applyKeyframes(u32, f32, at, n, links) {
    const xyz = at + 2 * n, quaternion = at + 5 * n, ends = at + 9 * n, to = at + 10 * n, kind = to + links;
    let begin = 0;
    for (let i = 0; i < n; ++i) {
      const slot = u32[at + i], end = u32[ends + i];
      while (this.keyframes.length <= slot) this.keyframes.push(null);
      if (this.keyframes[slot]) this.numKeyframes--;
      this.keyframes[slot] = null;
      if (u32[at + n + i] !== kGone) {
        this.keyframes[slot] = {
          frame: u32[at + n + i],
          centre: f32.slice(xyz + 3 * i, xyz + 3 * i + 3),
          rotation: f32.slice(quaternion + 4 * i, quaternion + 4 * i + 4),
          links: u32.slice(to + begin, to + end),
          kinds: u32.slice(kind + begin, kind + end),
        };
        this.numKeyframes++;
      }
      begin = end;
    }
    if (n > 0) this.keyframesDirty = true;
    return at + 10 * n + 2 * links;
  }

  applyPath(u32, f32, at, n) {
    for (let i = 0; i < n; ++i) {
      const p = at + n + 3 * i;
      if (Number.isNaN(f32[p])) {
        this.path.delete(u32[at + i]);
      } else {
        this.path.set(u32[at + i], [f32[p], f32[p + 1], f32[p + 2], u32[at + 4 * n + i]]);
      }
    }
    if (n > 0) this.pathDirty = true;
    return at + 5 * n;
  }

  applyTruth(u32, f32, at, n) {
    for (let i = 0; i < n; ++i) {
      const p = at + n + 3 * i;
      this.truth.set(u32[at + i], [f32[p], f32[p + 1], f32[p + 2]]);
    }
    if (n > 0) this.truthDirty = true;
  }

  /// Where the camera was, in order of frames: what is known of frames, and keyframes where nothing is (a viewer that came
  /// late). [[frame, x, y, z], ...]
  trajectory() {
    const places = new Map();
    for (const keyframe of this.keyframes) if (keyframe) places.set(keyframe.frame, keyframe.centre);
    for (const [frame, p] of this.path) places.set(frame, p);
    return [...places].map(([frame, p]) => [frame, p[0], p[1], p[2]]).sort((a, b) => a[0] - b[0]);
  }
}

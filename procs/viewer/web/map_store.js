// A mirror of the viewer's tables of what is drawn: landmarks in tiles, keyframes, path, ground truth and cameras.

const kTileSlots = 2048;
const kMagic = 0x56534d44;
const kGone = 0xffffffff;
const kFramesOfCamera = 2 ** 32;

/// Maps beyond so many, and cameras, have a colour that another one has.
export const kColours = 6;

/// Landmarks whose slots are neighbours were made one after the other, so they lie together: a tile is a place. Within a
/// tile they are kept in random order, so that the first n of them are a fair sample.
class Tile {
  constructor() {
    this.positions = new Float32Array(3 * kTileSlots);
    this.values = new Float32Array(3 * kTileSlots);  // belief, first frame, colour
    this.slotAt = new Int32Array(kTileSlots);        // by place in the arrays
    this.placeOf = new Int32Array(kTileSlots).fill(-1);
    this.count = 0;
    this.dirty = true;
    this.centre = [0, 0, 0];
    this.radius = 0;
  }

  set(slot, x, y, z, belief, first, colour) {
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
    this.values[3 * place] = belief;
    this.values[3 * place + 1] = first;
    this.values[3 * place + 2] = colour;
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
    this.values.copyWithin(3 * to, 3 * from, 3 * from + 3);
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
    this.arrangement = 0;  // places of another one do not go together with these
    this.cameras = new Map();  // by number: where it is among what is drawn, {p, q}
    this.clear();
  }

  clear() {
    this.version = 0;
    this.tiles = [];
    this.numPoints = 0;
    this.keyframes = [];  // by slot: null or {frame, camera, colour, centre, rotation, links}
    this.numKeyframes = 0;
    this.path = new Map();   // by camera and frame: {camera, frame, colour, place: [x, y, z], later}
    this.truth = new Map();  // by camera and number: {camera, place: [x, y, z]}
    this.newestFrame = 1;
    this.pathDirty = this.keyframesDirty = this.truthDirty = true;
  }

  /// Takes in what the viewer sent; returns whether anything changed.
  apply(buffer) {
    const u32 = new Uint32Array(buffer);
    const f32 = new Float32Array(buffer);
    if (u32[0] !== kMagic || u32[1] !== 3) throw new Error('this page and the viewer do not belong together; reload');
    const [generation, flags, version, points, keyframes, links, path, truth] = u32.slice(2, 10);
    const anew = (flags & 1) !== 0;
    if (anew) this.clear();
    this.generation = generation;
    this.version = version;
    let at = 10;
    at = this.applyPoints(u32, f32, at, points);
    at = this.applyKeyframes(u32, f32, at, keyframes, links);
    at = this.applyPath(u32, f32, at, path);
    at = this.applyTruth(u32, f32, at, truth);
    this.applyCameras(u32, f32, at);
    return anew || points + keyframes + path + truth > 0;
  }

  applyPoints(u32, f32, at, n) {
    const xyz = at + 3 * n, belief = at + 6 * n, first = at + 7 * n, colour = at + 8 * n;
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
        tile.set(slot % kTileSlots, f32[p], f32[p + 1], f32[p + 2], b, u32[first + i], u32[colour + i] % kColours);
        if (u32[first + i] > this.newestFrame) this.newestFrame = u32[first + i];
      }
      this.numPoints += tile.count - before;
    }
    return at + 9 * n;
  }

  applyKeyframes(u32, f32, at, n, links) {
    const xyz = at + 2 * n, quaternion = at + 5 * n, camera = at + 9 * n, colour = at + 10 * n;
    const ends = at + 11 * n, to = at + 12 * n, kind = to + links;
    let begin = 0;
    for (let i = 0; i < n; ++i) {
      const slot = u32[at + i], end = u32[ends + i];
      while (this.keyframes.length <= slot) this.keyframes.push(null);
      if (this.keyframes[slot]) this.numKeyframes--;
      this.keyframes[slot] = null;
      if (u32[at + n + i] !== kGone) {
        this.keyframes[slot] = {
          frame: u32[at + n + i],
          camera: u32[camera + i],
          colour: u32[colour + i] % kColours,
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
    return at + 12 * n + 2 * links;
  }

  applyPath(u32, f32, at, n) {
    for (let i = 0; i < n; ++i) {
      const frame = u32[at + i], camera = u32[at + n + i], p = at + 2 * n + 3 * i;
      const key = camera * kFramesOfCamera + frame;
      if (Number.isNaN(f32[p])) {
        this.path.delete(key);
      } else {
        const place = [f32[p], f32[p + 1], f32[p + 2]];
        this.path.set(key, {camera, frame, colour: u32[at + 6 * n + i] % kColours, place, later: u32[at + 5 * n + i]});
      }
    }
    if (n > 0) this.pathDirty = true;
    return at + 7 * n;
  }

  applyTruth(u32, f32, at, n) {
    for (let i = 0; i < n; ++i) {
      const camera = u32[at + n + i], p = at + 2 * n + 3 * i;
      this.truth.set(camera * kFramesOfCamera + u32[at + i], {camera, place: [f32[p], f32[p + 1], f32[p + 2]]});
    }
    if (n > 0) this.truthDirty = true;
    return at + 5 * n;
  }

  applyCameras(u32, f32, at) {
    this.arrangement = u32[at];
    this.cameras.clear();
    for (let i = 0; i < u32[at + 1]; ++i) {
      const c = at + 2 + 8 * i;
      this.cameras.set(u32[c], {p: [...f32.slice(c + 1, c + 4)], q: [...f32.slice(c + 4, c + 8)]});
    }
  }

  /// Where the cameras were, one after the other, in order of frames: what is known of frames, and keyframes where nothing is
  /// (a viewer that came late). [{camera, frame, colour, place: [x, y, z]}, ...]
  trajectory() {
    const places = new Map();
    for (const keyframe of this.keyframes) {
      if (keyframe) places.set(keyframe.camera * kFramesOfCamera + keyframe.frame, {...keyframe, place: keyframe.centre});
    }
    for (const [key, point] of this.path) places.set(key, point);
    return [...places].sort((a, b) => a[0] - b[0]).map(([, point]) => point);
  }
}

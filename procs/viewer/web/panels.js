// Everything beside the map: header, frame, charts, processes.

const byId = (id) => document.getElementById(id);
const kWindowSeconds = 60;
const kBuckets = 240;
const kAxisRem = 3.6;  // width of the axes: the charts and the strip above them lie over one another
const kStates = {0: 'none', 1: 'none', 2: 'warn', 3: 'good', 4: 'warn', 5: 'bad', 6: 'good', 8: 'warn'};
const thousands = (n) => Number(n).toLocaleString('en').replace(/,/g, '\u202f');
const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const text = (id, value) => { if (byId(id).textContent !== value) byId(id).textContent = value; };

export class Header {
  constructor() {
    this.poses = new Map();  // by camera: its newest one
    this.chosen = 0;
    this.ended = false;
  }

  choose(camera) {
    this.chosen = camera;
    this.showPose();
  }

  /// `camera`: the one that is shown.
  onStatus(status, camera) {
    const shown = {sequence: status.sequence, frames: status.frames, first_frame: status.first_frame, ...camera};
    text('sequence', shown.sequence || 'waiting for a camera');
    text('mode', status.sequence ? [status.lockstep ? 'lock-step' : 'real time', status.ended ? 'ended' : ''].filter((s) => s).join(', ') : '');
    this.frames = shown.frames > 0 ? shown.frames : 0;
    this.firstFrame = shown.first_frame || 0;
    this.ended = status.ended || Boolean(camera.ended);
    this.showPose();
    if (!status.map) return;
    text('count-keyframes', thousands(status.map.keyframes));
    text('count-landmarks', thousands(status.map.landmarks));
    text('count-moving', status.map.landmarks > 0 ? (100 * status.map.moving / status.map.landmarks).toFixed(1) + ' %' : '–');
    text('count-loops', String(status.map.loops));
    text('count-error', status.truth ? this.length(status.truth.rmse) : '–');
  }

  length(metres) { return metres < 1 ? (100 * metres).toFixed(1) + ' cm' : metres.toFixed(2) + ' m'; }

  onPose(pose) {
    this.poses.set(pose.camera, pose);
    if (pose.camera === this.chosen) this.showPose();
  }

  /// Once the sequence is over it counts no more how its last frame was tracked.
  showPose() {
    const pose = this.poses.get(this.chosen);
    if (this.ended) this.showState('finished', 'done');
    else if (pose) this.showState(pose.word, kStates[pose.state]);
    if (pose) this.showFrame(pose);
  }

  showFrame(pose) {
    const number = pose.frame - this.firstFrame + 1;
    byId('count-frame').innerHTML = thousands(number) + (this.frames ? ` <small>/ ${thousands(this.frames)}</small>` : '');
  }

  showState(word, state) {
    text('state', word);
    byId('state').dataset.state = state;
  }
}

/// The newest frame with its features. One picture is asked for at a time; what comes meanwhile is passed over.
export class FramePanel {
  constructor() {
    this.canvas = byId('frame');
    this.context = this.canvas.getContext('2d');
    this.colours = {1: '#2ee66b', 2: '#ffd83d', 3: '#ff3b30'};
    this.shown = 0;
    this.newest = new Map();  // by camera
    this.chosen = 0;
  }

  choose(camera) {
    this.chosen = camera;
    if (this.newest.has(camera)) this.show(this.newest.get(camera));
  }

  onFeatures(features) {
    this.newest.set(features.camera, features);
    if (features.camera === this.chosen) this.show(features);
  }

  show(features) {
    this.next = features;
    if (!this.busy) this.fetchNext();
  }

  async fetchNext() {
    const features = this.next;
    this.next = null;
    this.busy = true;
    try {
      const answer = await fetch(`/api/frame.jpg?frame=${features.frame}&camera=${features.camera}`);
      if (answer.status === 200) await this.draw(features, await createImageBitmap(await answer.blob()));
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // no connection: it comes again
    } finally {
      this.busy = false;
    }
    if (this.next) this.fetchNext();
  }

  async draw(features, image) {
    const {width, height} = features;
    const zoom = 2;
    if (this.canvas.width !== zoom * width) {
      this.canvas.width = zoom * width;
      this.canvas.height = zoom * height;
      this.canvas.parentElement.style.aspectRatio = `${width} / ${height}`;
    }
    this.context.drawImage(image, 0, 0, this.canvas.width, this.canvas.height);
    image.close();
    const bytes = Uint8Array.from(atob(features.data), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    for (const kind of [2, 1, 3]) this.drawKind(view, bytes, kind, zoom);
    const [, used, rejected, moving] = features.counts;
    text('kind-used', String(used));
    text('kind-rejected', String(rejected));
    text('kind-moving', String(moving));
    text('frame-number', String(features.frame));
    this.shown++;
  }

  drawKind(view, bytes, kind, zoom) {
    const context = this.context;
    const radius = (kind === 2 ? 3.2 : 4.4) * zoom;
    context.beginPath();
    for (let i = 0; i + 4 < bytes.length; i += 5) {
      if (bytes[i + 4] !== kind) continue;
      const u = (view.getUint16(i, true) / 16 + 0.5) * zoom, v = (view.getUint16(i + 2, true) / 16 + 0.5) * zoom;
      context.moveTo(u + radius, v);
      context.arc(u, v, radius, 0, 2 * Math.PI);
    }
    context.lineWidth = 2.6 * zoom;
    context.strokeStyle = 'rgba(0, 0, 0, 0.55)';
    context.stroke();
    context.lineWidth = 1.5 * zoom;
    context.strokeStyle = this.colours[kind];
    context.stroke();
    if (kind !== 3) return;
    context.fillStyle = 'rgba(255, 59, 48, 0.45)';
    context.fill();
  }
}

/// What is plotted over time; asks for what is new twice a second.
export class SeriesPanel {
  constructor() {
    this.camera = 0;
    this.clear(0);
    this.charts = [
      this.makeChart('chart-inliers', 'inliers', 'inliers', '--good', (v) => String(Math.round(v))),
      this.makeChart('chart-share', 'share', 'moving share', '--bad', (v) => (100 * v).toFixed(0) + ' %'),
      this.makeChart('chart-latency', 'latency', 'latency', '--accent', (v) => (v < 1000 ? v.toFixed(0) + ' ms' : v / 1000 + ' s')),
    ];
    this.applyTheme();
  }

  choose(camera) {
    this.camera = camera;
    this.clear(0);
  }

  clear(run) {
    this.run = run;
    this.end = 0;
    this.data = {t: [], frame: [], state: [], inliers: [], moving: [], share: [], latency: []};
  }

  makeChart(id, key, label, colourName, format) {
    const chart = new Chart(byId(id), {
      type: 'line',
      data: {datasets: [{label, data: [], borderWidth: 1.8, pointRadius: 0, fill: true, tension: 0}]},
      options: {
        animation: false, responsive: true, maintainAspectRatio: false, parsing: false, normalized: true, events: [],
        plugins: {legend: {display: false}, tooltip: {enabled: false}},
        scales: {
          x: {type: 'linear', grid: {display: false}, ticks: {display: key === 'latency', maxTicksLimit: 5, includeBounds: false, maxRotation: 0, callback: (v) => Math.round(v) + ' s'}},
          y: {beginAtZero: true, afterFit: (scale) => { scale.width = kAxisRem * rem(); }, grid: {}, ticks: {maxTicksLimit: 4, callback: format}},
        },
      },
    });
    return {chart, key, colourName};
  }

  applyTheme() {
    const size = 0.78 * rem();
    for (const {chart, colourName} of this.charts) {
      const c = colour(colourName);
      chart.data.datasets[0].borderColor = c;
      chart.data.datasets[0].backgroundColor = c + '28';
      for (const axis of ['x', 'y']) {
        const scale = chart.options.scales[axis];
        scale.ticks.color = colour('--soft');
        scale.ticks.font = {size, family: getComputedStyle(document.body).fontFamily};
        scale.grid.color = colour('--line');
        scale.grid.borderColor = colour('--line');
      }
      chart.update('none');
    }
    this.draw();
  }

  async poll() {
    const {camera, end} = this;
    const answer = await fetch(`/api/series?since=${end}&camera=${camera}`);
    const series = await answer.json();
    if (camera !== this.camera || end !== this.end) return undefined;  // another was chosen meanwhile
    if (series.run !== this.run || series.end < this.end) {
      const anew = this.run !== 0 && this.end !== 0;
      this.clear(series.run);
      if (anew) return this.poll();  // from the beginning
    }
    if (series.end === this.end) return undefined;
    for (const key of Object.keys(this.data)) this.data[key].push(...series[key]);
    this.end = series.end;
    this.draw();
    return undefined;
  }

  draw() {
    const {t, state} = this.data;
    if (t.length === 0) return;
    const newest = t[t.length - 1];
    const span = Math.min(kWindowSeconds, Math.max(4, newest - t[0]));
    let begin = t.length;
    while (begin > 0 && t[begin - 1] >= newest - span) begin--;
    for (const {chart, key} of this.charts) {
      chart.data.datasets[0].data = this.buckets(begin, key);
      chart.options.scales.x.min = Math.max(0, newest - span);
      chart.options.scales.x.max = Math.max(newest, 4);
      chart.update('none');
    }
    this.drawStrip(begin, this.charts[0].chart.options.scales.x);
    const tracked = state.filter((s) => s >= 2 && s <= 4).length;
    text('value-tracked', (100 * tracked / state.length).toFixed(1) + ' %');
    text('count-tracked', (100 * tracked / state.length).toFixed(0) + ' %');
    const last = (key) => this.data[key][t.length - 1];
    text('value-inliers', String(last('inliers')));
    text('value-share', (100 * last('share')).toFixed(0) + ' %');
    text('value-latency', last('latency').toFixed(0) + ' ms');
  }

  /// At most so many points: the mean of what falls together.
  buckets(begin, key) {
    const {t} = this.data, values = this.data[key];
    const step = Math.max(1, Math.ceil((t.length - begin) / kBuckets));
    const points = [];
    for (let i = begin; i < t.length; i += step) {
      const end = Math.min(i + step, t.length);
      let sum = 0;
      for (let k = i; k < end; ++k) sum += values[k];
      points.push({x: t[end - 1], y: sum / (end - i)});
    }
    return points;
  }

  /// Over the same time as the charts, {min, max}.
  drawStrip(begin, time) {
    const canvas = byId('strip'), {t, state} = this.data;
    const ratio = window.devicePixelRatio;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    const context = canvas.getContext('2d');
    const colours = {good: colour('--good'), warn: colour('--warn'), bad: colour('--bad'), none: colour('--line')};
    const at = (seconds) => Math.round((seconds - time.min) / (time.max - time.min) * canvas.width);
    for (let i = begin; i < t.length; ++i) {
      context.fillStyle = colours[kStates[state[i]]];
      const from = at(i > 0 ? t[i - 1] : time.min);
      context.fillRect(from, 0, Math.max(1, at(t[i]) - from), canvas.height);
    }
  }
}

export class ProcessPanel {
  onStatus(status) {
    const body = document.querySelector('#processes tbody');
    while (body.rows.length < status.processes.length) {
      const row = body.insertRow();
      for (let i = 0; i < 9; ++i) row.insertCell();
      row.cells[1].innerHTML = '<span class="life"></span>';
      row.cells[3].innerHTML = '<span></span><i class="beat"></i>';
    }
    status.processes.forEach((process, i) => this.fill(body.rows[i], process));
    this.showEvents(status.events);
  }

  fill(row, process) {
    const silent = process.life === 'down';
    row.dataset.life = process.life;
    row.dataset.name = process.name;
    const set = (i, value, alarm) => {
      if (row.cells[i].textContent !== value) row.cells[i].textContent = value;
      row.cells[i].className = alarm ? 'alarm' : '';
    };
    set(0, process.name);
    const times = process.restarts > 0 ? ` ×${process.restarts}` : '';
    row.cells[1].firstChild.textContent = process.life + (silent ? '' : times);
    row.cells[1].title = process.restarts > 0 ? `restarted ${process.restarts} times` : '';
    const known = process.life !== 'awaited';
    set(2, silent ? 'silent' : process.state || '');
    row.cells[2].title = [process.reason, process.waiting_for && `waits for ${process.waiting_for}`].filter((s) => s).join('; ');
    row.cells[3].firstChild.textContent = known ? process.age.toFixed(1) + ' s' : '–';
    row.cells[3].className = silent ? 'alarm' : '';
    const tells = process.rss !== undefined;  // the collector only says that it is there
    set(4, tells ? process.rss.toFixed(0) + ' MB' : '–');
    set(5, tells ? thousands(process.queue) : '–');
    set(6, tells ? thousands(process.dropped) : '–', process.dropped > 0);
    set(7, tells ? thousands(process.repaired) : '–');
    set(8, tells ? thousands(process.lost) : '–', process.lost > 0);
  }

  /// Text of a weld that happened since this was asked last; none where nothing did.
  newWeld(events) {
    const welds = events.filter((event) => event.n > (this.lastEvent || 0) && event.text.endsWith(' are joined'));
    const isFirst = this.lastEvent === undefined;
    if (events.length) this.lastEvent = events[events.length - 1].n;
    return welds.length && !isFirst ? welds[welds.length - 1].text : undefined;
  }

  showEvents(events) {
    const newest = events.length ? events[events.length - 1].n : 0;
    const key = events.length ? `${newest} ${events[events.length - 1].at}` : '';
    if (key === this.newest) return;
    this.newest = key;
    const list = byId('events');
    list.textContent = '';
    for (const event of events.slice(-12).reverse()) {
      const item = document.createElement('li');
      item.dataset.level = event.level;
      const time = document.createElement('time');
      time.textContent = new Date(event.at).toTimeString().slice(0, 8);
      const what = document.createElement('span');
      what.textContent = what.title = event.text;
      item.append(time, what);
      list.append(item);
    }
  }
}

/// The bar under everything, where a log is shown.
export class PlaybackPanel {
  constructor() {
    this.state = null;
    byId('play').addEventListener('click', () => this.toggle());
    byId('time').addEventListener('input', () => this.seek());
    byId('time').addEventListener('change', () => { this.held = false; });
    byId('speed').addEventListener('change', () => this.wish(`speed=${byId('speed').value}`));
  }

  onState(state) {
    this.state = state;
    byId('playback').hidden = false;
    text('play', state.playing ? '❚❚' : '▶');
    if (!this.held) byId('time').value = String(Math.round(1000 * state.position / Math.max(state.duration, 1e-3)));
    text('clock', `${this.clock(state.position)} / ${this.clock(state.duration)}`);
    if (document.activeElement !== byId('speed')) byId('speed').value = String(state.speed);
  }

  clock(seconds) { return `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, '0')}`; }

  toggle() {
    if (this.state) this.wish(`playing=${this.state.playing ? 0 : 1}`);
  }

  /// While the slider is pulled the newest place counts, one request at a time.
  seek() {
    this.held = true;
    this.wanted = `position=${(byId('time').value / 1000 * this.state.duration).toFixed(3)}`;
    if (this.seeking) return;
    this.seeking = true;
    (async () => {
      while (this.wanted) {
        const wanted = this.wanted;
        this.wanted = null;
        await this.wish(wanted);
      }
      this.seeking = false;
    })();
  }

  async wish(what) {
    try {
      await fetch(`/api/playback?${what}`, {method: 'POST'});
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // no connection
    }
  }
}

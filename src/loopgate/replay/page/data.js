// Unpacks the data and answers who was where, in which state, and who held what, at any moment.

const FREE = 0, HELD = 1, STANDS = 2, JAM = 3;
const JAM_S = 180; // who has stood for longer is in a jam
const STANDING_DM_PER_S = 3; // slower than this counts as standing
const TURN = 256;

async function unpack(text) {
  const letters = atob(text);
  const packed = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) packed[i] = letters.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const size = new DataView(bytes.buffer).getUint32(0, true);
  const words = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
  return { words, column: (place) => readColumn(bytes, 4 + size, place) };
}

// A column: planes of bytes, signs folded into the lowest bit, differences taken so many times.
function readColumn(bytes, start, [at, length, width, differences]) {
  const values = new Int32Array(length);
  for (let plane = 0; plane < width; plane++) {
    const from = start + at + plane * length;
    for (let i = 0; i < length; i++) values[i] |= bytes[from + i] << (8 * plane);
  }
  for (let i = 0; i < length; i++) values[i] = (values[i] >>> 1) ^ -(values[i] & 1);
  for (let again = 0; again < differences; again++) {
    for (let i = 1; i < length; i++) values[i] += values[i - 1];
  }
  return values;
}

// A line is stored as its first point, then steps; here as points, in tenths of a metre.
function readLine(steps) {
  const points = Float32Array.from(steps);
  for (let i = 2; i < points.length; i++) points[i] += points[i - 2];
  return points;
}

// The last row in [from, to) whose value is not above `limit`; from - 1 if there is none.
function lastUpTo(values, from, to, limit) {
  while (from < to) {
    const middle = (from + to) >> 1;
    if (values[middle] <= limit) from = middle + 1;
    else to = middle;
  }
  return from - 1;
}

// Rows that lasted from `begin` to `end`, grouped by a key and in order of their beginnings.
class Spans {
  constructor([what, whose, begin, lasted, why], keys, byVehicle) {
    Object.assign(this, { what, whose, begin, why });
    this.end = begin.map((value, row) => value + lasted[row]);
    this.first = new Int32Array(keys + 1);
    for (const key of byVehicle ? whose : what) this.first[key + 1]++;
    for (let key = 0; key < keys; key++) this.first[key + 1] += this.first[key];
    this.over = this.end.slice();
    for (let key = 0; key < keys; key++) this.over.subarray(this.first[key], this.first[key + 1]).sort();
  }

  count(key, frame) {
    const from = this.first[key], to = this.first[key + 1];
    return lastUpTo(this.begin, from, to, frame) - lastUpTo(this.over, from, to, frame);
  }

  // The rows under way, the earliest first.
  rows(key, frame) {
    const found = [];
    let missing = this.count(key, frame);
    for (let row = lastUpTo(this.begin, this.first[key], this.first[key + 1], frame); missing > 0; row--) {
      if (this.end[row] > frame) { found.unshift(row); missing--; }
    }
    return found;
  }
}

class Run {
  constructor(words, column) {
    Object.assign(this, words);
    [this.owner, this.begin, this.length] = words.tracks.map(column);
    this.x = column(words.x);
    this.y = column(words.y);
    this.heading = column(words.heading);
    const vehicles = this.vehicles.length, columns = (names) => names.map(column);
    this.visits = new Spans(columns(words.visits), this.places.length, false);
    this.passages = new Spans(columns(words.passages), this.links.length, false);
    this.refusals = new Spans(columns(words.refusals), vehicles, true);
    this.holds = new Spans(columns(words.holds), vehicles, true);
    [this.lapOf, this.lapAt] = words.laps.map(column);
    this.loops = words.loops.map(([name, line]) => ({ name, line: readLine(line) }));
    this.places = words.places.map(([name, room, line]) => ({ name, room, line: readLine(line) }));
    this.links = words.links.map((line) => ({ line: readLine(line), to: -1 }));
    for (const [places, links] of words.after) {
      links.forEach((link, k) => { this.links[link].to = places[(k + 1) % places.length]; });
    }
    this.number = new Map(this.vehicles.map((name, vehicle) => [name, vehicle]));
    this.last_s = this.first_s + (this.frames - 1) * this.step_s;
    this.visitsOf = this.vehicles.map(() => []);
    this.visits.whose.forEach((vehicle, row) => this.visitsOf[vehicle].push(row));
    for (const rows of this.visitsOf) rows.sort((a, b) => this.visits.begin[a] - this.visits.begin[b]);
    this.indexTracks();
    this.findStates();
    this.px = new Float32Array(vehicles);
    this.py = new Float32Array(vehicles);
    this.turn = new Float32Array(vehicles); // radians, clockwise from north
    this.state = new Int8Array(vehicles); // -1: not on the road
    this.counts = [0, 0, 0, 0];
  }

  indexTracks() {
    this.start = new Int32Array(this.owner.length + 1);
    this.length.forEach((length, track) => { this.start[track + 1] = this.start[track] + length; });
    this.firstTrack = new Int32Array(this.vehicles.length + 1);
    for (const vehicle of this.owner) this.firstTrack[vehicle + 1]++;
    for (let v = 0; v < this.vehicles.length; v++) this.firstTrack[v + 1] += this.firstTrack[v];
  }

  // Whether somebody drives, is held at a gate, or stands, row by row; and how many are in a jam, step by step.
  findStates() {
    this.states = new Uint8Array(this.x.length);
    this.jammed = new Int32Array(this.frames);
    const back = Math.max(1, Math.round(1 / this.step_s)), slow = STANDING_DM_PER_S * back * this.step_s;
    for (let track = 0; track < this.owner.length; track++) {
      const from = this.start[track], to = this.start[track + 1], vehicle = this.owner[track];
      for (let row = from; row < to; row++) {
        const before = Math.max(from, row - back);
        const far = Math.hypot(this.x[row] - this.x[before], this.y[row] - this.y[before]);
        if (far < slow) this.states[row] = STANDS;
      }
      for (let span = this.holds.first[vehicle]; span < this.holds.first[vehicle + 1]; span++) {
        const first = from + Math.max(0, this.holds.begin[span] - this.begin[track]);
        const last = Math.min(to, from + this.holds.end[span] - this.begin[track]);
        for (let row = first; row < last; row++) this.states[row] = HELD;
      }
      for (let row = from, since = from; row < to; row++) {
        if (this.states[row] === FREE) since = row + 1;
        else if ((row - since) * this.step_s >= JAM_S) {
          this.states[row] = JAM;
          this.jammed[this.begin[track] + row - from]++;
        }
      }
    }
  }

  frameAt(time) {
    return Math.min(this.frames - 1, Math.max(0, (time - this.first_s) / this.step_s));
  }

  // The row of a vehicle at a whole frame; -1 if it is not on the road.
  rowOf(vehicle, frame) {
    for (let track = this.firstTrack[vehicle]; track < this.firstTrack[vehicle + 1]; track++) {
      const k = frame - this.begin[track];
      if (k >= 0 && k < this.length[track]) return this.start[track] + k;
    }
    return -1;
  }

  // Metres per second over the second before.
  speed(vehicle, frame) {
    const back = Math.max(1, Math.round(1 / this.step_s));
    const now = this.rowOf(vehicle, frame), before = this.rowOf(vehicle, frame - back);
    if (now < 0 || before < 0) return 0;
    return Math.hypot(this.x[now] - this.x[before], this.y[now] - this.y[before]) / 10 / (back * this.step_s);
  }

  // Put everybody where they are at a moment between two frames.
  moveTo(at) {
    const frame = Math.floor(at), share = at - frame;
    this.frame = frame;
    this.counts = [0, 0, 0, 0];
    this.state.fill(-1);
    for (let track = 0; track < this.owner.length; track++) {
      const vehicle = this.owner[track], k = frame - this.begin[track];
      if (k < 0 || k >= this.length[track]) continue;
      const row = this.start[track] + k, next = k + 1 < this.length[track] ? row + 1 : row;
      const turned = ((this.heading[next] - this.heading[row] + TURN * 1.5) % TURN) - TURN / 2;
      this.px[vehicle] = this.x[row] + share * (this.x[next] - this.x[row]);
      this.py[vehicle] = this.y[row] + share * (this.y[next] - this.y[row]);
      this.turn[vehicle] = (this.heading[row] + share * turned) * (2 * Math.PI / TURN);
      this.state[vehicle] = this.states[row];
      this.counts[this.states[row]]++;
    }
  }

  // The last place that a vehicle has got, and the one behind it on its loop; null where there are no places.
  way(vehicle, frame) {
    const row = this.visitsOf[vehicle].findLast((one) => this.visits.begin[one] <= frame);
    if (row === undefined) return null;
    const [places] = this.after[this.loop_of[vehicle]], here = this.visits.what[row];
    return [here, places[(places.indexOf(here) + 1) % places.length]].map((place) => this.places[place].name);
  }

  lapsUpTo(frame) {
    return lastUpTo(this.lapAt, 0, this.lapAt.length, frame) + 1;
  }

  // The places that are closed or blocked, each with its cause in words and the vehicle that stands there.
  blockedAt(frame) {
    const now = this.blocked.filter(([, begin, end]) => begin <= frame && frame < end);
    return now.map(([place, , , why, vehicle, until]) => {
      const { name } = this.places[place], end = until === null ? "" : ` until ${clock(until)}`;
      return { place, vehicle, words: vehicle < 0 ? `${name} is ${why}${end}` : `${this.vehicles[vehicle]} stands on ${name} (${why})${end}` };
    });
  }

  circlesAt(frame) {
    return this.circles.filter(([, begin, end]) => begin <= frame && frame < end);
  }
}

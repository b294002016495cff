// Draws one run at one moment: ground, places, ways, bodies, circles, arrows.

const LEVELS = 4;
const LEAST_BODY = [7, 3.4]; // pixels
const MOST_AT_ONCE = 64; // bodies in one path: browsers take far longer for one of a thousand
const SPARE = 1.5; // the ground is kept for so much more than is seen

function trace(context, line) {
  context.moveTo(line[0], line[1]);
  for (let i = 2; i < line.length; i += 2) context.lineTo(line[i], line[i + 1]);
}

function mix(one, other, share) {
  const parts = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  const [a, b] = [parts(one), parts(other)];
  return `rgb(${a.map((value, k) => Math.round(value + share * (b[k] - value))).join(" ")})`;
}

// The colours of the style sheet, which knows light and dark.
function readColours() {
  const style = getComputedStyle(document.documentElement), found = {};
  for (const name of ["ground", "road", "casing", "free", "held", "stands", "jam", "edge", "place", "full", "taken", "circle",
    "chosen", "ink", "back", "soft", "line"]) found[name] = style.getPropertyValue(`--${name}`).trim();
  found.levels = [...Array(LEVELS + 1).keys()].map((k) => mix(found.place, found.full, k / LEVELS));
  found.states = [found.free, found.held, found.stands, found.jam];
  return found;
}

// The streets, drawn once for a scale and a place, wider than the canvas, and then only moved.
class Ground {
  constructor(streets) {
    this.lanes = streets.lanes.map(([width, lines]) => [width, this.path(lines)]);
    this.junctions = this.path(streets.junctions);
    this.canvas = document.createElement("canvas");
    this.key = "";
  }

  path(lines) {
    const path = new Path2D();
    for (const line of lines) trace(path, readLine(line));
    return path;
  }

  draw(context, view, ratio, width, height, colours) {
    const key = [view.scale, ratio, width, height, colours.road].join();
    const far = Math.max(Math.abs(view.x - this.x) / width, Math.abs(view.y - this.y) / height) * view.scale;
    if (key !== this.key || far > (SPARE - 1) / 2) {
      this.key = key;
      this.x = view.x;
      this.y = view.y;
      this.paint(view, ratio, width * SPARE, height * SPARE, colours);
    }
    const right = (this.x - view.x) * view.scale - width * (SPARE - 1) / 2;
    const down = (view.y - this.y) * view.scale - height * (SPARE - 1) / 2;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.canvas, Math.round(right * ratio), Math.round(down * ratio));
  }

  paint(view, ratio, width, height, colours) {
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const context = this.canvas.getContext("2d", { alpha: false });
    context.fillStyle = colours.ground;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    view.onto(context, ratio, width, height);
    context.lineCap = "round";
    for (const [colour, extra] of [[colours.casing, 1.6], [colours.road, 0]]) {
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = extra / view.scale;
      if (extra) context.stroke(this.junctions);
      context.fill(this.junctions);
      for (const [lane, path] of this.lanes) {
        context.lineWidth = Math.max(lane, 1.2 / view.scale) + extra / view.scale;
        context.stroke(path);
      }
    }
  }
}

// A body from its front back; the front is narrower, so that one sees where it goes.
function outline(context, x, y, turn, back, side) {
  const east = Math.sin(turn), north = Math.cos(turn), taper = 0.72;
  context.moveTo(x - north * side * taper, y + east * side * taper);
  context.lineTo(x + north * side * taper, y - east * side * taper);
  context.lineTo(x - east * back * 0.2 + north * side, y - north * back * 0.2 - east * side);
  context.lineTo(x - east * back + north * side, y - north * back - east * side);
  context.lineTo(x - east * back - north * side, y - north * back + east * side);
  context.lineTo(x - east * back * 0.2 - north * side, y - north * back * 0.2 + east * side);
  context.closePath();
}

class Painter {
  constructor(canvas, run, ground, view) {
    Object.assign(this, { canvas, run, ground, view });
    this.context = canvas.getContext("2d", { alpha: false });
  }

  draw(colours, chosen) {
    const { canvas, context, run, view } = this;
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    Object.assign(this, { ratio, width, height, colours });
    this.ground.draw(context, view, ratio, width, height, colours);
    view.onto(context, ratio, width, height);
    this.pixel = 1 / view.scale; // of the screen, in tenths of a metre
    context.lineCap = "butt";
    context.lineJoin = "round";
    if (chosen >= 0 && chosen < run.loop_of.length) {
      this.lines([run.loops[run.loop_of[chosen]].line], mix(colours.free, colours.road, 0.35), 9, 3);
    }
    this.places();
    this.ways();
    this.blocked();
    const circles = run.circlesAt(run.frame);
    for (const [vehicles] of circles) this.circle(vehicles, 0.4, 60, 9);
    this.bodies();
    for (const [vehicles] of circles) this.circle(vehicles, 1, 0, 1.6);
    if (chosen >= 0 && run.state[chosen] >= 0) this.chosen(chosen);
  }

  lines(lines, colour, width, least) {
    const { context } = this;
    context.strokeStyle = colour;
    context.lineWidth = Math.max(width, least * this.pixel);
    context.beginPath();
    for (const line of lines) trace(context, line);
    context.stroke();
  }

  // Places by how full they are; those that are empty stay as pale as the road.
  places() {
    const levels = Array.from({ length: LEVELS + 1 }, () => []);
    this.run.places.forEach(({ line, room }, place) => {
      const inside = room ? this.run.visits.count(place, this.run.frame) : 0;
      if (inside) levels[Math.min(LEVELS, Math.floor(LEVELS * inside / room))].push(line);
    });
    levels.forEach((lines, level) => this.lines(lines, this.colours.levels[level], 26, 2));
  }

  ways() {
    const taken = [];
    this.run.links.forEach(({ line }, link) => {
      if (this.run.passages.count(link, this.run.frame)) taken.push(line);
    });
    this.lines(taken, this.colours.taken, 8, 1.2);
  }

  // Closed and blocked places.
  blocked() {
    const { context, run, colours, pixel } = this;
    context.setLineDash([5 * pixel, 3 * pixel]);
    this.lines(run.blockedAt(run.frame).map(({ place }) => run.places[place].line), colours.circle, 14, 3);
    context.setLineDash([]);
  }

  bodies() {
    const { context, run, colours, pixel } = this;
    const shortest = LEAST_BODY[0] * pixel, thinnest = LEAST_BODY[1] * pixel;
    const edged = this.view.scale > 0.12;
    context.strokeStyle = colours.edge;
    context.lineWidth = pixel;
    for (const state of [FREE, HELD, STANDS, JAM]) {
      context.fillStyle = colours.states[state];
      let waiting = 0;
      const paint = () => {
        context.fill();
        if (edged) context.stroke();
        waiting = 0;
      };
      for (let vehicle = 0; vehicle < run.vehicles.length; vehicle++) {
        if (run.state[vehicle] !== state || !this.seen(run.px[vehicle], run.py[vehicle])) continue;
        if (!waiting++) context.beginPath();
        const [length, width] = run.sizes[vehicle];
        const back = Math.max(10 * length, shortest), side = 0.5 * Math.max(10 * width, thinnest);
        outline(context, run.px[vehicle], run.py[vehicle], run.turn[vehicle], back, side);
        if (waiting === MOST_AT_ONCE) paint();
      }
      if (waiting) paint();
    }
  }

  // Whether a point is on the canvas, or a vehicle's length beside it.
  seen(x, y) {
    const { view } = this, spare = 200;
    return Math.abs(x - view.x) < this.width * this.pixel / 2 + spare
      && Math.abs(y - view.y) < this.height * this.pixel / 2 + spare;
  }

  middle(vehicle) {
    const { run } = this, back = 5 * run.sizes[vehicle][0];
    return [run.px[vehicle] - back * Math.sin(run.turn[vehicle]), run.py[vehicle] - back * Math.cos(run.turn[vehicle])];
  }

  // The circle of a deadlock: from each vehicle to the one it waits for.
  circle(vehicles, strong, width, least) {
    const { context, colours } = this;
    context.globalAlpha = strong;
    context.strokeStyle = colours.circle;
    context.lineWidth = Math.max(width, least * this.pixel);
    context.beginPath();
    vehicles.forEach((vehicle, k) => context[k ? "lineTo" : "moveTo"](...this.middle(vehicle)));
    context.closePath();
    context.stroke();
    context.globalAlpha = 1;
  }

  chosen(vehicle) {
    const { context, run, colours, pixel } = this, chain = chainOf(run, vehicle, run.frame);
    const place = waitOf(run, vehicle, run.frame)?.place ?? -1;
    if (place >= 0) {
      context.setLineDash([6 * pixel, 4 * pixel]);
      this.lines([run.places[place].line], colours.chosen, 0, 2);
      context.setLineDash([]);
    }
    for (let k = 1; k < chain.length; k++) this.arrow(this.middle(chain[k - 1]), this.middle(chain[k]));
    const [x, y] = this.middle(vehicle), radius = Math.max(45, 13 * pixel);
    context.strokeStyle = colours.chosen;
    context.lineWidth = 2 * pixel;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.stroke();
    this.label(run.vehicles[vehicle], x, y, radius);
  }

  arrow([x, y], [u, v]) {
    const { context, pixel } = this, far = Math.hypot(u - x, v - y);
    if (far < pixel) return;
    const east = (u - x) / far, north = (v - y) / far, head = Math.min(9 * pixel, far / 2);
    context.strokeStyle = context.fillStyle = this.colours.chosen;
    context.lineWidth = 2 * pixel;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(u - east * head, v - north * head);
    context.stroke();
    context.beginPath();
    context.moveTo(u, v);
    context.lineTo(u - east * head - north * head / 2, v - north * head + east * head / 2);
    context.lineTo(u - east * head + north * head / 2, v - north * head - east * head / 2);
    context.fill();
  }

  label(text, x, y, radius) {
    const { context, view, ratio, colours } = this;
    const left = view.left(x, this.width), top = view.top(y, this.height) - radius * view.scale - 6;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "600 13px system-ui, sans-serif";
    context.textAlign = "center";
    context.lineWidth = 4;
    context.strokeStyle = colours.back;
    context.strokeText(text, left, top);
    context.fillStyle = colours.ink;
    context.fillText(text, left, top);
  }
}

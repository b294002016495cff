// The clock and all that turns it: buttons, keys, the slider; and what is told of the chosen vehicle.

const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50, 100, 200];
const TELL_EVERY_MS = 150;
const MOST_LISTED = 12;
const find = (id) => document.getElementById(id);

class Player {
  constructor({ words, column }) {
    this.runs = words.runs.map((run) => new Run(run, column));
    const grounds = words.streets.map((streets) => new Ground(streets));
    const views = new Map();
    const stage = find("stage");
    stage.replaceChildren();
    this.panels = this.runs.map((run) => {
      if (!views.has(run.streets)) views.set(run.streets, new View(this.box(run.streets)));
      return new Panel(stage, run, this.runs.length > 1 ? new Ground(words.streets[run.streets]) : grounds[run.streets],
        views.get(run.streets), this.colour(run), (who) => this.touched(who));
    });
    this.views = [...views.values()];
    this.first = Math.min(...this.runs.map((run) => run.first_s));
    this.last = Math.max(...this.runs.map((run) => run.last_s));
    this.time = this.first;
    this.speed = 10;
    this.playing = false;
    this.chosen = null;
    this.told = 0;
    this.frames = 0; // drawn so far
    this.colours = readColours();
    this.controls();
    this.keys();
    this.curve();
    this.changed = true;
    requestAnimationFrame((now) => this.tick(now));
  }

  // Of its line over the time: two runs side by side need two.
  colour(run) {
    return this.runs.length > 1 && run === this.runs[1] ? "free" : "jam";
  }

  // Around all positions of the runs on the same streets.
  box(streets) {
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    for (const run of this.runs.filter((one) => one.streets === streets)) {
      for (let row = 0; row < run.x.length; row++) {
        box[0] = Math.min(box[0], run.x[row]);
        box[1] = Math.max(box[1], run.x[row]);
        box[2] = Math.min(box[2], run.y[row]);
        box[3] = Math.max(box[3], run.y[row]);
      }
    }
    return box;
  }

  tick(now) {
    if (this.playing) {
      this.time = Math.min(this.last, this.time + this.speed * Math.min(0.25, (now - (this.before ?? now)) / 1000));
      if (this.time >= this.last) this.play(false);
      this.changed = true;
    }
    this.before = now;
    if (this.changed) this.draw(now);
    requestAnimationFrame((next) => this.tick(next));
  }

  draw(now) {
    this.changed = false;
    for (const panel of this.panels) panel.moveTo(this.time);
    for (const panel of this.panels) {
      if (!panel.view.scale || panel.view.fitted) panel.view.fit(...panel.size);
      panel.painter.draw(this.colours, this.chosen?.run === panel.run ? this.chosen.vehicle : -1);
    }
    this.frames++;
    if (!this.playing || now - this.told > TELL_EVERY_MS) this.tell(now);
  }

  tell(now) {
    this.told = now;
    find("clock").textContent = clock(this.time);
    find("time").value = this.time - this.first;
    find("time").setAttribute("aria-valuetext", clock(this.time));
    for (const panel of this.panels) panel.tell(this.time);
    this.about();
  }

  seek(time) {
    this.time = Math.min(this.last, Math.max(this.first, time));
    this.changed = true;
  }

  play(playing) {
    if (playing && this.time >= this.last) this.time = this.first;
    this.playing = playing;
    find("play").textContent = playing ? "Pause" : "Play";
    this.changed = true;
  }

  faster(steps) {
    const at = SPEEDS.indexOf(this.speed) + steps;
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at))];
    find("speed").value = this.speed;
  }

  fit() {
    for (const view of this.views) view.fitted = true;
    for (const view of this.views) view.followed = null;
    this.changed = true;
  }

  zoom(factor) {
    for (const view of this.views) {
      const [width, height] = this.panels.find((panel) => panel.view === view).size;
      view.zoom(factor, width / 2, height / 2, width, height);
    }
    this.changed = true;
  }

  // Somebody clicked, or moved the map.
  touched(who) {
    if (who) this.choose(who.run, who.vehicle);
    this.changed = true;
  }

  choose(run, vehicle) {
    this.chosen = vehicle >= 0 ? { run, vehicle } : null;
    find("vehicle").value = this.chosen ? run.vehicles[vehicle] : "";
    for (const view of this.views) view.followed = null;
    if (this.chosen) this.follow();
    this.shown = "";
    this.changed = true;
  }

  follow() {
    const panel = this.panels.find((one) => one.run === this.chosen?.run);
    if (!panel) return;
    panel.view.followed = panel.view.followed ? null : this.chosen;
    if (panel.view.followed && panel.view.scale < 0.12) panel.view.scale = 0.25;
    if (panel.view.followed) panel.view.fitted = false;
    this.shown = "";
    this.changed = true;
  }

  another(step) {
    const run = this.chosen?.run ?? this.runs[0], all = run.vehicles.length;
    this.choose(run, this.chosen ? (this.chosen.vehicle + step + all) % all : 0);
  }

  // The moments at which something of a kind happened, in order: when, whose.
  moments(kind) {
    const found = [];
    for (const run of this.runs) {
      const add = (vehicle, frame) => {
        if (!this.chosen || (this.chosen.run === run && this.chosen.vehicle === vehicle)) {
          found.push({ time: run.first_s + frame * run.step_s, run, vehicle });
        }
      };
      if (kind === "lap") run.lapOf.forEach((vehicle, row) => add(vehicle, run.lapAt[row]));
      if (kind === "refusal") run.refusals.whose.forEach((vehicle, row) => add(vehicle, run.refusals.begin[row]));
      if (kind === "deadlock") {
        for (const [vehicles, begin] of run.circles) {
          const named = this.chosen?.run === run && vehicles.includes(this.chosen.vehicle);
          add(named ? this.chosen.vehicle : vehicles[0], begin);
        }
      }
    }
    return found.sort((a, b) => a.time - b.time);
  }

  step(kind, direction) {
    const moments = this.moments(kind), near = 0.5 * this.runs[0].step_s;
    const next = direction > 0 ? moments.find(({ time }) => time > this.time + near)
      : moments.findLast(({ time }) => time < this.time - near);
    if (!next) return;
    this.play(false);
    this.seek(next.time);
    if (kind !== "deadlock" && !this.chosen) this.choose(next.run, next.vehicle);
  }

  // The runs side by side as on the page, with their names, counts and the time, for a paper or a print.
  picture() {
    const shown = this.panels.map((panel) => panel.canvas), ratio = window.devicePixelRatio || 1, head = 52 * ratio;
    const whole = document.createElement("canvas"), context = whole.getContext("2d", { alpha: false });
    whole.width = shown.reduce((sum, canvas) => sum + canvas.width, 0);
    whole.height = head + Math.max(...shown.map((canvas) => canvas.height));
    context.fillStyle = this.colours.ground;
    context.fillRect(0, 0, whole.width, whole.height);
    context.fillStyle = this.colours.ink;
    let left = 0;
    for (const panel of this.panels) {
      context.font = `bold ${15 * ratio}px sans-serif`;
      context.fillText(`${panel.run.name}, ${clock(this.time)}`, left + 10 * ratio, 20 * ratio);
      context.font = `${13 * ratio}px sans-serif`;
      context.fillText(panel.counts.textContent, left + 10 * ratio, 40 * ratio);
      context.drawImage(panel.canvas, left, head);
      left += panel.canvas.width;
    }
    return whole;
  }

  save() {
    this.draw(performance.now());
    this.picture().toBlob((picture) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(picture);
      link.download = `replay-${clock(this.time).replaceAll(":", "-")}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }, "image/png");
  }

  controls() {
    const speed = find("speed"), time = find("time");
    for (const value of SPEEDS) speed.add(new Option(`${value}×`, value, false, value === this.speed));
    speed.addEventListener("change", () => { this.speed = Number(speed.value); });
    time.max = this.last - this.first;
    time.step = Math.min(...this.runs.map((run) => run.step_s));
    time.addEventListener("input", () => this.seek(this.first + Number(time.value)));
    find("play").addEventListener("click", () => this.play(!this.playing));
    find("fit").addEventListener("click", () => this.fit());
    find("save").addEventListener("click", () => this.save());
    find("keys").addEventListener("click", () => find("help").showModal());
    for (const kind of ["refusal", "deadlock", "lap"]) {
      find(kind).addEventListener("click", () => this.step(kind, 1));
      find(kind).disabled = !this.moments(kind).length;
    }
    const names = new Set(this.runs.flatMap((run) => run.vehicles));
    find("vehicles").replaceChildren(...[...names].map((name) => new Option(name)));
    find("vehicle").addEventListener("change", (event) => {
      const name = event.target.value.trim();
      const run = this.runs.find((one) => one === this.chosen?.run && one.number.has(name))
        ?? this.runs.find((one) => one.number.has(name));
      if (run) this.choose(run, run.number.get(name));
      else this.choose(null, -1);
    });
    new ResizeObserver(() => { this.curve(); this.changed = true; }).observe(find("stage"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.colours = readColours();
      this.curve();
      this.changed = true;
    });
  }

  keys() {
    const actions = {
      " ": () => this.play(!this.playing),
      "[": () => this.faster(-1), "]": () => this.faster(1),
      r: () => this.step("refusal", 1), R: () => this.step("refusal", -1),
      d: () => this.step("deadlock", 1), D: () => this.step("deadlock", -1),
      l: () => this.step("lap", 1), L: () => this.step("lap", -1),
      n: () => this.another(1), p: () => this.another(-1), f: () => this.follow(),
      "+": () => this.zoom(1.4), "=": () => this.zoom(1.4), "-": () => this.zoom(1 / 1.4), 0: () => this.fit(),
      Escape: () => this.choose(null, -1), "?": () => find("help").showModal(),
      ArrowRight: (event) => this.seek(this.time + (event.shiftKey ? 10 : this.runs[0].step_s)),
      ArrowLeft: (event) => this.seek(this.time - (event.shiftKey ? 10 : this.runs[0].step_s)),
    };
    document.addEventListener("keydown", (event) => {
      const at = event.target, own = at.tagName === "SELECT" || at.type === "text" || find("help").open;
      const pressed = at.tagName === "BUTTON" && event.key === " ", slid = at.type === "range" && event.key.startsWith("Arrow");
      if (own || pressed || slid || event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
      event.preventDefault();
      actions[event.key](event);
    });
  }

  // How many are in a jam, over the time, and where deadlocks were recognised.
  curve() {
    const canvas = find("curve"), ratio = window.devicePixelRatio || 1, context = canvas.getContext("2d");
    const width = canvas.width = Math.round(canvas.clientWidth * ratio);
    const height = canvas.height = Math.round(canvas.clientHeight * ratio);
    const left = (time) => (time - this.first) / Math.max(1e-9, this.last - this.first) * width;
    const most = Math.max(1, ...this.runs.map((run) => run.vehicles.length));
    for (const run of this.runs) {
      context.strokeStyle = this.colours[this.colour(run)];
      context.lineWidth = 1.5 * ratio;
      context.beginPath();
      const every = Math.max(1, Math.floor(run.frames / width));
      for (let frame = 0; frame < run.frames; frame += every) {
        const y = height - 1 - (height - 2) * run.jammed[frame] / most;
        context[frame ? "lineTo" : "moveTo"](left(run.first_s + frame * run.step_s), y);
      }
      context.stroke();
      context.fillStyle = this.colours.circle;
      for (const [, begin] of run.circles) context.fillRect(left(run.first_s + begin * run.step_s) - ratio, 0, 2 * ratio, height);
    }
  }

  about() {
    const box = find("about"), { chosen } = this;
    box.hidden = !chosen;
    if (!chosen) return;
    const { run, vehicle } = chosen, frame = run.frame, wait = waitOf(run, vehicle, frame);
    const lines = aboutLines(run, vehicle, frame, wait);
    const chain = wait ? chainOf(run, vehicle, frame) : [];
    const key = [run.name, vehicle, ...lines, ...chain].join("|");
    if (key === this.shown) return; // so that what is focused or marked stays
    this.shown = key;
    const title = document.createElement("h2"), name = document.createElement("span");
    name.textContent = this.runs.length > 1 ? `${run.vehicles[vehicle]} (${run.name})` : run.vehicles[vehicle];
    const followed = this.views.some((view) => view.followed);
    title.append(name, button(followed ? "Stop following" : "Follow", () => this.follow()),
      button("×", () => this.choose(null, -1), "Choose nobody"));
    const list = document.createElement("ol");
    for (const other of chain.slice(1, MOST_LISTED + 1)) {
      const item = document.createElement("li"), why = waitOf(run, other, frame);
      const words = !why ? "drives" : wait.circle && why.circle === wait.circle ? "in the same deadlock" : why.words;
      item.append(button(run.vehicles[other], () => this.choose(run, other)), `: ${words}`);
      list.append(item);
    }
    const more = chain.length - 1 - MOST_LISTED;
    const waiting = chain.length > 1 ? [paragraph("It waits for"), list] : [];
    if (more > 0) waiting.push(paragraph(`and ${more} more`));
    box.className = this.runs.length > 1 && run === this.runs[1] ? "first" : "last"; // never over its own map
    box.replaceChildren(title, ...lines.map(paragraph), ...waiting);
  }
}

function aboutLines(run, vehicle, frame, wait) {
  const lines = [], loop = run.loops[run.loop_of[vehicle]], row = run.rowOf(vehicle, frame);
  if (loop) {
    let laps = 0;
    for (let k = run.lapsUpTo(frame) - 1; k >= 0; k--) if (run.lapOf[k] === vehicle) laps++;
    lines.push(`On ${loop.name}, ${many(laps, "lap")} so far`);
  }
  if (row < 0) return [...lines, "It is not on the road"];
  lines.push(`${(3.6 * run.speed(vehicle, frame)).toFixed(0)} km/h`);
  const way = run.way(vehicle, frame);
  if (!wait) return [...lines, way ? `It drives to ${way[0]}, then to ${way[1]}` : "It drives"];
  lines.push(`${run.state[vehicle] === FREE ? "Refused" : "Waits"} since ${clock(run.first_s + wait.since * run.step_s)}: ${wait.words}`);
  if (wait.place >= 0) {
    const { name, room } = run.places[wait.place];
    lines.push(`It wants to go to ${name}` + (room ? ` (${run.visits.count(wait.place, frame)} of ${room} taken)` : ""));
  }
  return lines;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}

function button(text, act, label) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  if (label) made.setAttribute("aria-label", label);
  made.addEventListener("click", act);
  return made;
}

unpack(find("data").textContent).then((data) => {
  window.replay = new Player(data);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) window.replay.play(true);
}, () => { find("loading").textContent = "This browser cannot unpack the replay; one of 2023 or later can."; });

// One run on the page: its canvas, its caption, and what the pointer does there.

const CLICK_PX = 6, NEAR_PX = 14, MOST_BLOCKED = 3;

class Panel {
  constructor(stage, run, ground, view, colour, choose) {
    Object.assign(this, { run, view, choose });
    const section = document.createElement("section");
    section.className = "panel";
    section.append(this.caption(colour), this.canvas = document.createElement("canvas"));
    stage.append(section);
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Map of ${run.network} under ${run.name}`);
    this.painter = new Painter(this.canvas, run, ground, view);
    this.pointers = new Map();
    this.listen();
  }

  caption(colour) {
    const caption = document.createElement("div");
    caption.className = `caption ${colour}`; // that of its line over the time
    const title = document.createElement("h2");
    title.textContent = this.run.name;
    [this.counts, this.alarm] = [document.createElement("p"), document.createElement("p")];
    this.alarm.className = "alarm";
    caption.append(title, this.counts, this.alarm);
    return caption;
  }

  get size() { return [this.canvas.clientWidth, this.canvas.clientHeight]; }

  moveTo(time) {
    this.run.moveTo(this.run.frameAt(time));
    const followed = this.view.followed;
    if (followed && followed.run === this.run && this.run.state[followed.vehicle] >= 0) {
      this.view.x = this.run.px[followed.vehicle];
      this.view.y = this.run.py[followed.vehicle];
    }
  }

  tell(time) {
    const { run } = this, [driving, held, standing, jammed] = run.counts;
    const parts = [`${driving} driving`, ...(run.gated ? [`${held} held`] : []), `${standing} standing`];
    this.counts.textContent = `${parts.join(", ")}, ${jammed} in a jam; ${many(run.lapsUpTo(run.frame), "lap")}`;
    const circles = run.circlesAt(run.frame);
    const words = circles.map(([vehicles, begin]) =>
      `Deadlock of ${vehicles.length} since ${clock(run.first_s + begin * run.step_s)}`);
    const all = run.blockedAt(run.frame), first = ({ vehicle }, k) => all.findIndex((one) => one.vehicle === vehicle) === k;
    const blocked = all.filter((one, k) => one.vehicle < 0 || first(one, k)).map((one) => one.words);
    words.push(...blocked.slice(0, MOST_BLOCKED));
    if (blocked.length > MOST_BLOCKED) words.push(`${blocked.length - MOST_BLOCKED} more are closed or blocked`);
    if (time > run.last_s + run.step_s) words.push(`The run ended at ${clock(run.last_s)}`);
    this.alarm.textContent = words.join(". ");
  }

  // The vehicle nearest to a point of the canvas; -1 if none is near.
  pick(left, top) {
    const { run, view } = this, [width, height] = this.size;
    let nearest = NEAR_PX, found = -1;
    for (let vehicle = 0; vehicle < run.vehicles.length; vehicle++) {
      if (run.state[vehicle] < 0) continue;
      const [x, y] = this.painter.middle(vehicle);
      const far = Math.hypot(view.left(x, width) - left, view.top(y, height) - top);
      if (far < nearest) { nearest = far; found = vehicle; }
    }
    return found;
  }

  listen() {
    const { canvas, pointers } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      this.moved = pointers.size > 1 ? Infinity : 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const now = [event.offsetX, event.offsetY], right = now[0] - before[0], down = now[1] - before[1];
      this.moved += Math.hypot(right, down);
      if (pointers.size === 1 && this.moved > CLICK_PX) this.view.pan(right, down);
      if (pointers.size === 2) this.pinch(event.pointerId, before, now);
      if (this.moved > CLICK_PX) pointers.set(event.pointerId, now);
      this.choose(null);
    });
    const up = (event) => {
      if (!pointers.delete(event.pointerId) || event.type !== "pointerup" || this.moved > CLICK_PX) return;
      this.choose({ run: this.run, vehicle: this.pick(event.offsetX, event.offsetY) });
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.view.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY, ...this.size);
      this.choose(null);
    }, { passive: false });
  }

  pinch(moving, before, now) {
    const [, other] = [...this.pointers].find(([id]) => id !== moving);
    const far = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
    this.view.zoom(far(now) / far(before), other[0], other[1], ...this.size);
    this.pointers.set(moving, now);
  }
}

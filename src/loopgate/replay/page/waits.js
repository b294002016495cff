// Why somebody stands, and behind whom: from the gate's answers under a gate, from sight elsewhere.

const LOOK_AHEAD_DM = 80;
const BESIDE_DM = 18;
const LONGEST_CHAIN = 60;

// The reason in words, whom it waits for, since when [frames], and the place it wants; null for one that drives.
function waitOf(run, vehicle, frame) {
  const circle = run.circlesAt(frame).find(([vehicles]) => vehicles.includes(vehicle));
  const row = run.refusals.rows(vehicle, frame).pop();
  const stands = run.state[vehicle] > FREE;
  if (row === undefined && !stands) return null;
  const wait = { words: "", whom: [], since: frame, place: -1, refused: row !== undefined, circle };
  if (row !== undefined) {
    const link = run.refusals.what[row];
    wait.place = run.links[link].to;
    wait.since = run.refusals.begin[row];
    wait.words = run.why[run.refusals.why[row]] ?? "the gate refuses it";
    wait.whom = blockers(run, vehicle, frame, link, run.refusals.why[row], wait.place);
    if (run.standing.includes(run.refusals.why[row])) {
      const there = run.blockedAt(frame).filter(({ place }) => place === wait.place);
      wait.words = there[0]?.words ?? wait.words;
      wait.whom = there.map((one) => one.vehicle).filter((other) => other >= 0 && other !== vehicle);
    }
  } else {
    const ahead = bodyAhead(run, vehicle);
    wait.words = ahead < 0 ? "nobody stands close ahead: it gives way, or has a red light or a stop" : "it stands in a queue";
    wait.whom = ahead < 0 ? [] : [ahead];
    wait.since = standsSince(run, vehicle, frame);
  }
  if (circle) {
    const [vehicles, begin] = circle;
    wait.whom = [vehicles[(vehicles.indexOf(vehicle) + 1) % vehicles.length]];
    wait.words = `it is in a deadlock of ${vehicles.length} since ${clock(run.first_s + begin * run.step_s)}`;
  }
  return wait;
}

function blockers(run, vehicle, frame, link, why, place) {
  let rows = [], spans = run.passages;
  if (why === run.crossing) rows = run.foes[link].flatMap((foe) => run.passages.rows(foe, frame));
  if (why === run.occupied && place >= 0) {
    spans = run.visits;
    rows = run.visits.rows(place, frame);
  }
  const whom = [...new Set(rows.map((row) => spans.whose[row]))].filter((other) => other !== vehicle);
  return why === run.occupied ? whom.slice(0, 1) : whom; // of a full place, its head
}

// The nearest body straight ahead; -1 if there is none.
function bodyAhead(run, vehicle) {
  const east = Math.sin(run.turn[vehicle]), north = Math.cos(run.turn[vehicle]);
  let nearest = LOOK_AHEAD_DM, found = -1;
  for (let other = 0; other < run.vehicles.length; other++) {
    if (other === vehicle || run.state[other] < 0) continue;
    const length = run.sizes[other][0] * 10;
    if (Math.abs(run.px[other] - run.px[vehicle]) > LOOK_AHEAD_DM + length) continue;
    for (const share of [1, 0.5, 0]) { // rear, middle, front
      const dx = run.px[other] - share * length * Math.sin(run.turn[other]) - run.px[vehicle];
      const dy = run.py[other] - share * length * Math.cos(run.turn[other]) - run.py[vehicle];
      const ahead = dx * east + dy * north, aside = Math.abs(dx * north - dy * east);
      if (ahead > -5 && ahead < nearest && aside < BESIDE_DM) { nearest = ahead; found = other; }
    }
  }
  return found;
}

function standsSince(run, vehicle, frame) {
  let since = frame;
  while (since > 0) {
    const row = run.rowOf(vehicle, since - 1);
    if (row < 0 || run.states[row] === FREE) break;
    since--;
  }
  return since;
}

// From a vehicle to whom it waits for, to whom that one waits for, and so on; a circle ends where it closes.
function chainOf(run, vehicle, frame) {
  const chain = [vehicle], seen = new Set(chain);
  while (chain.length < LONGEST_CHAIN) {
    const next = waitOf(run, chain[chain.length - 1], frame)?.whom[0];
    if (next === undefined) break;
    chain.push(next);
    if (seen.has(next)) break;
    seen.add(next);
  }
  return chain;
}

function many(number, what) {
  return `${number} ${what}${number === 1 ? "" : "s"}`;
}

function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds + 1e-6)), two = (n) => String(n).padStart(2, "0");
  const minutes = Math.floor(whole / 60) % 60, hours = Math.floor(whole / 3600);
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

"use strict";
const page = JSON.parse(document.getElementById("content").textContent);

function bytes(base64) {
  return Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
}

async function csv(name) {
  const packed = new Blob([bytes(page.tables[name].csv)]).stream();
  return new Response(packed.pipeThrough(new DecompressionStream("gzip"))).text();
}

async function save(name, kind) {
  const part = kind === "csv" ? await csv(name) : bytes(page.tables[name].parquet);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([part]));
  link.download = `${name}.${kind}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

for (const button of document.querySelectorAll("button[data-save]")) {
  button.addEventListener("click", () => save(button.dataset.save, button.dataset.kind));
}

for (const button of document.querySelectorAll("button[data-copy]")) {
  button.addEventListener("click", async () => {
    const table = document.getElementById(button.dataset.copy);
    const value = cell => cell.dataset.v ?? cell.textContent;
    const text = !table.rows ? table.textContent : [...table.rows].map(row => [...row.cells].map(value).join("\t")).join("\n");
    let done = true;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const box = document.createElement("textarea");
      box.value = text;
      document.body.append(box);
      box.select();
      done = document.execCommand("copy");
      box.remove();
    }
    button.textContent = done ? "Copied" : "Press Ctrl-C to copy";
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  });
}

for (const button of document.querySelectorAll("th > button")) {
  button.addEventListener("click", () => {
    const heading = button.parentElement;
    const up = heading.getAttribute("aria-sort") !== "ascending";
    for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", up ? "ascending" : "descending");
    const body = heading.closest("table").tBodies[0];
    const at = heading.cellIndex;
    const value = row => row.cells[at].dataset.v ?? row.cells[at].textContent;
    const compare = heading.classList.contains("n")
      ? (a, b) => (value(a) === "") - (value(b) === "") || (up ? 1 : -1) * (value(a) - value(b))
      : (a, b) => (up ? 1 : -1) * value(a).localeCompare(value(b), undefined, { numeric: true });
    body.append(...[...body.rows].sort(compare));
  });
}

const views = new Map();
const off = new Map();

function fitted(spec, width) {
  const fit = structuredClone(spec);
  if (fit.spec) {
    const most = fit.columns ?? 1;
    fit.columns = width < 520 ? 1 : most;
    const map = fit.usermeta?.map;
    const panel = Math.floor(width / fit.columns) - (map ? 20 : 58);
    fit.spec.height = map ? Math.round(fit.spec.height * panel / fit.spec.width) : fit.spec.height;
    fit.spec.width = panel;
    for (const { projection } of map ? [fit.spec, ...fit.spec.layer ?? []] : []) { // each layer has its own
      if (!projection) continue; // in pixels; map is how many metres are as broad as a panel
      const larger = panel / map / projection.scale;
      projection.scale *= larger;
      projection.translate = projection.translate.map(shift => shift * larger);
    }
  } else if (fit.vconcat) {
    for (const part of fit.vconcat) part.width = width - 56;
  } else {
    fit.width = width;
    fit.autosize = { type: "fit-x", contains: "padding" };
  }
  return fit;
}

async function draw(box) {
  const { spec, prefix } = page.specs[box.dataset.figure];
  const width = Math.floor(box.clientWidth);
  if (width < 50 || views.get(box)?.width === width) return;
  views.get(box)?.view.finalize();
  const fit = fitted(spec, width);
  for (const [name, table] of Object.entries(page.tables)) {
    if (table.rows && name.startsWith(prefix)) fit.datasets[name.slice(prefix.length)] = table.rows;
  }
  const made = await vegaEmbed(box, fit, {
    ast: true, renderer: "svg", actions: false, defaultStyle: false, tooltip: { disableDefaultStyle: true },
  });
  views.set(box, { view: made.view, width });
  made.view.signal("off", off.get(box.closest("section")) ?? []).run();
}

const boxes = [...document.querySelectorAll("[data-figure]")];
const watch = new IntersectionObserver(entries => {
  for (const entry of entries) if (entry.isIntersecting) draw(entry.target);
}, { rootMargin: "600px" });
for (const box of boxes) watch.observe(box);
let pending;
addEventListener("resize", () => {
  clearTimeout(pending);
  pending = setTimeout(() => { for (const box of views.keys()) draw(box); }, 150);
});
document.drawn = () => Promise.all(boxes.map(draw));
(window.requestIdleCallback ?? setTimeout)(async () => { for (const box of boxes) await draw(box); document.body.dataset.drawn = "all"; });

for (const box of document.querySelectorAll("input[data-series]")) {
  box.addEventListener("change", () => {
    const section = box.closest("section");
    const hidden = [...section.querySelectorAll("input[data-series]:not(:checked)")].map(b => b.dataset.series);
    off.set(section, hidden);
    for (const [figure, { view }] of views) {
      if (figure.closest("section") === section) view.signal("off", hidden).run();
    }
  });
}

if (location.hash === "#brief") document.body.classList.add("brief"); // figures without tables, as report --pdf prints
addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details")) part.open = true; });

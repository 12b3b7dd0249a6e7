// The page: what comes over the WebSocket, what the user does, and what is shown.
import { Layer, Stage, Tone } from "./picture.js";
import { Camera } from "./camera.js";
import { RacePanel, amount, name as racerName } from "./race.js";
import { SamplePanel } from "./sample.js";
import { Lights } from "./lights.js";

const $ = id => document.getElementById(id);
const REFERENCE = 255;
const layers = new Map();
const tone = new Tone();
const stage = new Stage($("stage"));
let status = null, hello = null, socket = null, tool = "look", errors = false, over = null, exact = null, frames = 0, drawn = null;

// ---- The server

function connect() {
  socket = new WebSocket(new URL("live", location.href).href.replace(/^http/, "ws"));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => typeof data === "string" ? hear(JSON.parse(data)) : see(data);
  socket.onclose = () => {
    state("gone", "no connection");
    setTimeout(connect, 1000);
  };
}
function ask(message) {
  // What was said is about what was done before.
  if (!["next", "pixel"].includes(message.do)) $("message").hidden = true;
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

let effort = 0;
function see(buffer) {
  const begun = performance.now();
  const id = new Uint32Array(buffer, 0, 1)[0];
  if (!layers.has(id)) layers.set(id, new Layer(id));
  layers.get(id).take(buffer);
  effort += performance.now() - begun;
}

const HEAR = {
  look({ epoch }) {
    for (const [id, layer] of layers) if (layer.epoch !== epoch) layers.delete(id);
    frames++;
    redraw(() => {
      drawn = { epoch, at: performance.now(), first: drawn?.first ?? performance.timeOrigin + performance.now() };
      // Drawing takes time from a render on the same machine, which takes fewer looks then.
      ask({ do: "next", ms: Math.min(effort, 1000) });
      effort = 0;
    });
  },
  hello(message) {
    hello = message;
    $("scene-name").textContent = hello.scene;
    document.title = `${hello.scene} – Octolux`;
    for (const [id, options] of [["estimator", hello.estimators], ["sampler", hello.samplers]])
      $(id).replaceChildren(...options.map(option => new Option(option)));
    $("write").title = `Write ${hello.outputs.join(" and ")} (W)`;
    races.known(hello);
    lights.known(hello.lights);
  },
  status(message) {
    const raced = Boolean(status?.race), races_now = Boolean(message.race);
    status = message;
    if (races_now && !raced) panel("race", true);
    if (raced && !races_now && !ending) say("The race has ended, because the camera, a light or the scene has changed. Start begins another one.", "note");
    if (!races_now) ending = false;
    lights.take(message.gains);
    stage.film = { width: status.width, height: status.height };
    $("estimator").value = status.estimator;
    $("sampler").value = status.sampler;
    camera.take(status.camera);
    $("camera-table").textContent = status.camera.table;
    $("camera-reset").disabled = !status.turned;
    races.take(status.race);
    document.body.classList.toggle("racing", Boolean(status.race));
    $("estimator").disabled = $("sampler").disabled = $("write").disabled = Boolean(status.race);
    const preparing = status.race && !status.race.reference.ready;
    state(status.state, status.state === "rendering" && preparing ? "reference" : status.state);
    $("play").textContent = status.state === "stopped" ? "Go on" : "Stop";
    $("play").disabled = status.state === "done" || status.state === "failed";
    figures();
    redraw();
  },
  scene(message) {
    $("scene-path").textContent = message.path;
    const lines = message.text.replace(/\n$/, "").split("\n"), wrong = message.error?.line;
    $("scene-text").replaceChildren(...lines.map((text, i) => {
      const line = document.createElement("div"), number = document.createElement("b");
      number.textContent = i + 1;
      line.className = i + 1 === wrong ? "wrong" : "";
      line.append(number, text);
      return line;
    }), ...(message.cut ? [Object.assign(document.createElement("div"), { textContent: "… the rest is not shown" })] : []));
    $("scene-error").hidden = !message.error;
    if (message.error) {
      $("scene-error").textContent = `${message.error.what}\n${message.error.help ?? ""}`;
      panel("scene", true);
      const text = $("scene-text"), line = text.querySelector(".wrong");
      if (line) text.scrollTop = line.offsetTop - text.offsetTop - text.clientHeight / 2;
      $("scene-error").scrollIntoView({ block: "nearest" });
    }
  },
  sample(message) {
    const opens = $("sample-panel").hidden;
    panel("sample", true);
    samples.take(message);
    if (opens) $("sample-panel").scrollIntoView({ block: "start" });
  },
  pixel(message) { exact = message; pointer(); },
  said({ level, what }) { if (level !== "error" || !races.refused(what)) say(what, level); },
};
const hear = message => HEAR[message.kind]?.(message);

// ---- What is shown

let asked = false, after = [];
function redraw(then) {
  if (then) after.push(then);
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    const begun = performance.now();
    const shown = visible();
    stage.draw(shown, tone, errors && status?.race ? layers.get(REFERENCE) : null);
    labels(shown);
    pointer();
    document.body.classList.toggle("legend", tone.mode === "false" || Boolean(errors && status?.race));
    // The pixel whose sample is open.
    const { at } = samples;
    if (at && !$("sample-panel").hidden) stage.mark(at.x, at.y, shown.length);
    if (after.length) effort += performance.now() - begun;
    const done = after;
    after = [];
    done.forEach(f => f());
  });
}
stage.changed = () => redraw();

/** The layers on the canvas: the picture, the racers, or the reference while it is rendered. */
function visible() {
  const ids = [...layers.keys()].filter(id => id !== REFERENCE).sort((a, b) => a - b);
  return (ids.length ? ids : [REFERENCE]).map(id => layers.get(id)).filter(Boolean);
}

function labels(shown) {
  const racers = status?.race?.racers, texts = [];
  if (racers) shown.forEach((layer, i) => {
    const cell = stage.cells(shown.length)[i];
    const text = layer.id === REFERENCE ? "the reference" : racerName(racers[layer.id] ?? {});
    const left = stage.split ? (i ? stage.dividers[i - 1] : 0) * stage.canvas.width : cell.x;
    texts.push([text, left / stage.ratio, Math.max(cell.y, stage.place(cell).y) / stage.ratio, layer.id === REFERENCE ? "var(--quiet)" : `var(--c${layer.id})`]);
  });
  const box = $("labels"), key = JSON.stringify(texts);
  if (box.dataset.key === key) return;
  box.dataset.key = key;
  box.replaceChildren(...texts.map(([text, x, y, of]) => {
    const label = document.createElement("span");
    label.textContent = text;
    label.style.left = `${x}px`; label.style.top = `${y}px`; label.style.setProperty("--of", of);
    return label;
  }));
}

function state(kind, text) { $("state").dataset.state = kind; $("state").textContent = text; }
const large = x => x >= 1e9 ? `${(x / 1e9).toFixed(2)} G` : x >= 1e6 ? `${(x / 1e6).toFixed(1)} M` : x >= 1e3 ? `${(x / 1e3).toFixed(0)} k` : `${x.toFixed(0)} `;
function figures() {
  const { picture, race } = status;
  let text = "";
  if (picture) {
    const spp = picture.least === picture.most ? picture.least : `${picture.least}–${picture.most}`;
    text = `${spp}${status.spp ? ` of ${status.spp}` : ""} spp · ${picture.seconds.toFixed(1)} s · ${large(picture.per_second)}samples/s`;
  } else if (race?.reference.ready) text = `${Math.min(...race.racers.map(r => r.seconds)).toFixed(1)} s each`;
  $("figures").textContent = text;
}

const short = x => Number.isFinite(x) ? (x !== 0 && (Math.abs(x) < 1e-3 || x >= 1e4) ? x.toExponential(3) : x.toPrecision(4)) : String(x);
function pointer() {
  $("zoom").textContent = stage.zoom === 1 ? "" : `${stage.zoom.toFixed(stage.zoom < 10 ? 1 : 0)} ×`;
  const shown = visible(), layer = over && shown[over.index];
  if (!over?.inside || !layer?.width) return $("pixel").replaceChildren();
  const same = layer.width === status?.width && layer.height === status?.height;
  const x = same ? over.x : Math.floor(over.x * layer.width / stage.film.width), y = same ? over.y : Math.floor(over.y * layer.height / stage.film.height);
  const found = exact && exact.x === over.x && exact.y === over.y ? exact.values.find(v => v.layer === layer.id)?.value : null;
  const value = found ?? layer.at(x, y), racer = status?.race?.racers[layer.id] ?? status?.picture;
  const where = [`pixel ${over.x}, ${over.y}`], what = [`radiance ${value.map(short).join("  ")}`];
  const sure = exact && exact.x === over.x && exact.y === over.y ? exact.standard_error : null;
  if (sure != null && !status?.race) what.push(`± ${sure.toPrecision(2)}`);
  if (status?.race) where.push(layer.id === REFERENCE ? "reference" : racerName(status.race.racers[layer.id]));
  if (racer && layer.id !== REFERENCE) where.push(`${racer.least === racer.most ? racer.least : `${racer.least}–${racer.most}`} samples`);
  const truth = status?.race && layer.id !== REFERENCE && layers.get(REFERENCE);
  if (truth?.width) {
    const error = value.reduce((sum, v, c) => { const r = truth.at(x, y)[c]; return sum + (v - r) ** 2 / (r * r + 1e-4) / 3; }, 0);
    what.push(`rel. error² ${amount(error)}`);
  }
  $("pixel").replaceChildren(...[where.join(" · "), what.join(" ")].map(text => Object.assign(document.createElement("div"), { textContent: text, title: text })));
}
let resting = 0;
function hover(event) {
  over = stage.pixel(event.clientX, event.clientY, visible().length);
  pointer();
  clearTimeout(resting);
  // A pointer that rests is told the full precision.
  if (over.inside) resting = setTimeout(() => ask({ do: "pixel", x: over.x, y: over.y }), 120);
}

let saying = 0;
function say(what, level) {
  const box = $("message");
  box.textContent = what; box.className = level; box.hidden = false;
  clearTimeout(saying);
  saying = setTimeout(() => { box.hidden = true; }, level === "error" ? 15000 : 9000);
}
$("message").onclick = () => { if (!getSelection().toString()) $("message").hidden = true; };

// ---- Panels

const camera = new Camera(view => ask({ do: "camera", ...view }));
const samples = new SamplePanel(ask), lights = new Lights(ask);
const races = new RacePanel(race => {
  errors = false; choose("look"); press("race-error", false);
  ask({ do: "race", ...race });
}, (what, field) => {
  panel("race", true);
  $("race-choices").open = true;
  field.focus();
  say(what, "error");
});
let ending = false;

function panel(which, open) {
  const section = $(`${which}-panel`);
  section.hidden = open === undefined ? !section.hidden : !open;
  const any = ["race", "sample", "scene"].some(name => !$(`${name}-panel`).hidden);
  $("side").hidden = !any;
  if (which === "race" && section.hidden && status?.race) { ending = true; ask({ do: "end-race" }); }
  if (which === "sample") redraw();
  if (!section.hidden && open !== true) section.scrollIntoView({ block: "nearest" });
}
for (const button of document.querySelectorAll("[data-close]")) button.onclick = () => panel(button.dataset.close, false);
$("race-open").onclick = () => panel("race");
$("scene-open").onclick = () => panel("scene");
const press = (id, on) => $(id).setAttribute("aria-pressed", on);
function arrange(split) {
  stage.split = split;
  const count = status?.race?.racers.length ?? 2;
  if (stage.dividers.length !== count - 1) stage.dividers = Array.from({ length: count - 1 }, (_, i) => (i + 1) / count);
  press("race-grid", !split); press("race-divider", split);
  redraw();
}
$("race-grid").onclick = () => arrange(false);
$("race-divider").onclick = () => arrange(true);
const errorMap = () => { errors = !errors; press("race-error", errors); layers.forEach(layer => { layer.stale = true; }); redraw(); };
$("race-error").onclick = errorMap;

// ---- What the user does

function choose(which) {
  tool = which;
  for (const name of ["look", "camera"]) press(`tool-${name}`, name === which);
  $("stage").classList.toggle("camera", which === "camera");
}
$("tool-look").onclick = () => choose("look");
$("tool-camera").onclick = () => choose("camera");
const play = () => !$("play").disabled && ask({ do: status?.state === "stopped" ? "go" : "stop" });
$("play").onclick = play;
const write = () => !$("write").disabled && ask({ do: "write", exposure: tone.stops });
$("write").onclick = write;
for (const id of ["estimator", "sampler"]) $(id).onchange = () => ask({ do: "settings", estimator: $("estimator").value, sampler: $("sampler").value });
function expose(stops) {
  tone.set({ stops: Math.max(-10, Math.min(10, stops)) });
  $("exposure").value = tone.stops;
  $("exposure-says").textContent = (tone.stops > 0 ? "+" : "") + tone.stops;
  redraw();
}
$("exposure").oninput = () => expose(Number($("exposure").value));
function show(mode) { tone.set({ mode }); $("tone").value = mode; redraw(); }
$("tone").onchange = () => show($("tone").value);
const fit = () => { stage.fit(); redraw(); };
$("fit").onclick = fit;
const home = () => { camera.sent = -Infinity; ask({ do: "reset-camera" }); };
$("camera-reset").onclick = home;
$("camera-copy").onclick = async () => {
  try {
    await navigator.clipboard.writeText($("camera-table").textContent);
    say("The [camera] table is copied: put it into the scene file in place of the old one.", "note");
  } catch {
    getSelection().selectAllChildren($("camera-table"));
    say("Copy the marked table.", "note");
  }
};
$("help-open").onclick = () => $("help").showModal();

const fingers = new Map();
let dragged = 0, divider = -1;
const canvas = $("stage"), aspect = () => stage.film.width / stage.film.height;
const open = ({ x, y, index, inside }) => inside && samples.open(x, y, status?.race ? visible()[index].id : 0);
canvas.onpointerdown = event => {
  canvas.setPointerCapture(event.pointerId);
  canvas.focus({ preventScroll: true });
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
  if (fingers.size === 1) dragged = 0;
  const at = (event.clientX - canvas.getBoundingClientRect().left) * stage.ratio / stage.canvas.width;
  divider = stage.split && visible().length > 1 ? stage.dividers.findIndex(d => Math.abs(d - at) * stage.canvas.width < 14 * stage.ratio) : -1;
};
canvas.onpointermove = event => {
  hover(event);
  const last = fingers.get(event.pointerId);
  if (!last) return;
  const now = [event.clientX, event.clientY], dx = now[0] - last[0], dy = now[1] - last[1], count = visible().length;
  dragged += Math.hypot(dx, dy);
  if (divider >= 0) {
    const low = stage.dividers[divider - 1] ?? 0, high = stage.dividers[divider + 1] ?? 1;
    stage.dividers[divider] = Math.max(low, Math.min(high, stage.dividers[divider] + dx * stage.ratio / stage.canvas.width));
    fingers.set(event.pointerId, now);
    return redraw();
  }
  if (fingers.size === 2) {
    const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
    const far = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
    const factor = far(now) / far(last), middle = [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2];
    if (tool === "camera") { camera.dolly(1 / factor); pan(dx / 2, dy / 2); }
    else { stage.zoomAt(factor, ...middle, count); stage.move(dx / 2, dy / 2, count); }
  } else if (dragged > 4) {
    if (tool === "look") stage.move(dx, dy, count);
    else if (event.shiftKey || event.buttons & 6) pan(dx, dy);
    else camera.orbit(dx * 0.008, dy * 0.008);
  }
  fingers.set(event.pointerId, now);
  redraw();
};
const pan = (dx, dy) => { const h = stage.place(stage.cells(1)[0]).h / stage.ratio; camera.pan(dx / h, dy / h, aspect()); };
canvas.onpointerup = event => {
  const single = fingers.size === 1;
  fingers.delete(event.pointerId);
  if (single && dragged <= 4 && tool === "look" && event.button === 0 && divider < 0) open(stage.pixel(event.clientX, event.clientY, visible().length));
  divider = -1;
};
canvas.onpointercancel = event => fingers.delete(event.pointerId);
canvas.onpointerleave = () => { over = null; clearTimeout(resting); pointer(); };
canvas.oncontextmenu = event => event.preventDefault();
canvas.ondblclick = event => {
  if (tool !== "camera") return;
  const { x, y, inside } = stage.pixel(event.clientX, event.clientY, visible().length);
  if (!inside) return;
  camera.sent = -Infinity;
  ask({ do: "aim", x, y });
};
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  const factor = Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015));
  if (tool === "camera") camera.dolly(1 / factor);
  else { stage.zoomAt(factor, event.clientX, event.clientY, visible().length); redraw(); }
}, { passive: false });

/** Zooms about the middle, or dollies. */
function nearer(factor) {
  if (tool === "camera") return camera.dolly(1 / factor);
  const box = canvas.getBoundingClientRect();
  stage.zoomAt(factor, box.left + box.width / 2, box.top + box.height / 2, visible().length);
  redraw();
}
function arrow(dx, dy, shift) {
  if (tool === "camera") return shift ? pan(dx * 20, dy * 20) : camera.orbit(dx * 0.05, dy * 0.05);
  stage.move(-dx * 40, -dy * 40, visible().length);
  redraw();
}
const KEYS = {
  " ": play, v: () => choose("look"), c: () => choose("camera"), 0: fit, Home: home, w: write,
  "+": () => nearer(1.25), "=": () => nearer(1.25), "-": () => nearer(0.8),
  "[": () => expose(tone.stops - 0.25), "]": () => expose(tone.stops + 0.25),
  f: () => show({ srgb: "false", false: "white", white: "srgb" }[tone.mode]),
  r: () => panel("race"), s: () => panel("scene"), x: () => status?.race && errorMap(), "?": () => $("help").showModal(),
  Enter: () => { const box = canvas.getBoundingClientRect(); open(stage.pixel(box.left + box.width / 2, box.top + box.height / 2, visible().length)); },
  Escape: () => ["sample", "scene", "race"].find(which => !$(`${which}-panel`).hidden && (panel(which, false), true)),
};
addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
  const typing = event.target.closest("input, select, textarea"), button = event.target.closest("button, summary");
  if (typing || (button && (event.key === " " || event.key === "Enter"))) return;
  const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (step) { if (event.target === canvas || event.target === document.body) { arrow(...step, event.shiftKey); event.preventDefault(); } return; }
  const act = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (act) { act(); event.preventDefault(); }
});

// For tests, and for whoever opens the console.
window.octolux = { layers, stage, tone, samples, camera, get status() { return status; }, get frames() { return frames; }, get drawn() { return drawn; } };
connect();

// One sample as a drawing: the hemisphere above the point, what is looked from, the lobe, the lights' caps, and each direction
// that was drawn, by its technique, with what was in its way.

const $ = id => document.getElementById(id);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const l = Math.hypot(...a); return a.map(x => x / l); };
const mix = (a, s, b, t) => a.map((x, i) => s * x + t * b[i]);

/** How the techniques are called and coloured. */
const TECHNIQUES = { cone: ["uniform in a light's cone", 0], cap: ["a light's cap by the cosine", 3], brdf: ["the BRDF's lobe", 1], lobe: ["the lobe inside a light's cap", 1], sphere: ["the whole sphere", 2], light: ["a light's own sampling", 0] };
/** Others by their own name. */
const technique = name => TECHNIQUES[name] ?? [name, 3];
const figure = x => x === 0 ? "0" : Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5 ? String(+x.toPrecision(3)) : x.toExponential(1);
const some = (n, one, many = `${one}s`) => `${n} ${n === 1 ? one : many}`;
/** Rows of the table: a scene may have hundreds of lights. */
const MOST_ROWS = 24;
/** Passes whose normal is farther from the first one's have met another side of an edge, and a drawing has one hemisphere. */
const NEAR = 0.9;

/** What is drawn as a lobe. Of models with microfacets none is: theirs is no power of a cosine. */
const LOBES = { diffuse: "cosine lobe", phong: "Phong lobe" };

export class SamplePanel {
  constructor(ask) {
    this.ask = ask;
    this.turn = -0.6; this.lift = 0.42;
    const canvas = $("hemisphere");
    const again = () => this.at && this.request();
    $("sample-pass").onchange = again;
    $("sample-count").oninput = () => { $("sample-count-says").textContent = 2 ** $("sample-count").value; again(); };
    canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); this.last = [event.clientX, event.clientY]; };
    canvas.onpointermove = event => {
      if (!this.last) return;
      this.rotate((event.clientX - this.last[0]) * 0.008, (event.clientY - this.last[1]) * 0.008);
      this.last = [event.clientX, event.clientY];
    };
    canvas.onpointerup = canvas.onpointercancel = () => { this.last = null; };
    canvas.onkeydown = event => {
      const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
      if (step) { this.rotate(...step); event.preventDefault(); event.stopPropagation(); }
    };
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }
  rotate(turn, lift) {
    this.turn += turn;
    this.lift = Math.max(0, Math.min(Math.PI / 2, this.lift + lift));
    this.draw();
  }
  open(x, y, layer) { this.at = { x, y, layer }; this.request(); }
  request() {
    const pass = Math.max(0, Math.floor(Number($("sample-pass").value)) || 0);
    this.ask({ do: "sample", ...this.at, pass, count: 2 ** $("sample-count").value });
  }
  take(sample) {
    this.sample = sample;
    const { replays } = sample;
    const first = replays.find(r => r.point);
    this.point = first?.point;
    // The passes on the surface of the first one.
    this.shown = replays.filter(r => r.point && dot(r.point.n, this.point.n) > NEAR);
    this.models = [...new Map(this.shown.map(r => [r.point.model, r])).values()];
    this.drawn = this.shown.flatMap(r => r.asked).filter(a => a.found);
    // A direction of the lobe is one for all lights of a pass: it is drawn once, if it meets none.
    this.missed = this.shown.flatMap(r => {
      const lobes = r.asked.filter(a => a.lobe && a.lobe.some(x => x)), met = lobes.some(a => a.found);
      return lobes.length && !met ? [lobes[0].lobe] : [];
    });
    // Rays to lights that are told one by one are drawn with them.
    const told = this.drawn.map(a => a.found.wi);
    this.rays = sample.rays.filter(ray => !told.some(wi => dot(wi, ray) > 1 - 1e-6));
    this.asked = replays.reduce((n, r) => n + r.asked.length, 0);
    this.blocked = this.drawn.filter(a => a.found.occluded).length;
    $("sample-title").textContent = `Pixel ${sample.x}, ${sample.y}`;
    const passes = replays.length === 1 ? `Pass ${sample.pass}` : `Passes ${sample.pass} to ${sample.pass + replays.length - 1}`;
    const radiance = replays.reduce((sum, r) => mix(sum, 1, r.radiance, 1 / replays.length), [0, 0, 0]);
    const untold = replays.some(r => r.meshes_untold), asked = this.shown.reduce((n, r) => n + r.asked.length, 0);
    const lone = this.drawn.some(a => a.light == null), could = this.drawn.length, blocked = this.blocked;
    const says = [];
    if (!this.point) says.push("The ray meets nothing that reflects.");
    else if (asked && lone) says.push(`${some(asked, "direction")}: ${could - blocked || "none"} ${could - blocked > 1 ? "meet" : "meets"} a light.`);
    else if (asked) says.push(`${some(asked, "direction")}${untold ? " to lights that are told one by one" : ""}: ${could ? `${could} could bring light, ${blocked || "none"} of them blocked` : "none could bring light"}.`);
    if (this.missed.length && !lone) says.push(this.missed.length === 1 ? "The direction of the lobe meets no light." : `${this.missed.length} directions of the lobe meet no light.`);
    if (untold) says.push(`${some(this.rays.length, "ray was", "rays were")} traced in all, also to large meshes; whether they arrived is in the radiance.`);
    const other = this.point ? replays.length - this.shown.length : 0;
    if (other) says.push(`${some(other, "pass", "passes")} met another surface and ${other === 1 ? "is" : "are"} not drawn.`);
    says.push(`Radiance ${radiance.map(figure).join(", ")}${replays.length > 1 ? ", the mean of all passes" : ""}.`);
    $("sample-says").textContent = `${passes} by ${sample.estimator}, ${sample.sampler}. ${says.join(" ")}`;
    this.table(replays[0], sample.pass);
    $("sample-text").textContent = sample.text;
    this.legend();
    this.draw();
  }
  /** The directions of the first pass, in numbers. */
  table(replay, pass) {
    const rows = replay.asked.slice(0, MOST_ROWS).map(a => {
      const to = a.sphere != null ? `sphere ${a.sphere + 1}` : a.kind ? `${a.kind}` : "any light", f = a.found;
      const end = f ? (f.occluded ? (a.light == null ? "no light" : "blocked") : "arrives") : a.lobe ? (a.lobe.some(x => x) ? "misses it" : "below ground") : "cannot";
      const numbers = f ? [figure(f.cos_theta), f.pdf == null ? "–" : figure(f.pdf), f.ld.map(x => figure(+x.toPrecision(2))).join(" ")] : ["", "", ""];
      const row = document.createElement("tr");
      row.style.setProperty("--of", f || a.lobe ? `var(--c${technique(a.technique)[1]})` : "transparent");
      row.append(...["", to, a.technique, ...numbers, end].map(text => Object.assign(document.createElement("td"), { textContent: text })));
      return row;
    });
    $("directions").hidden = !rows.length;
    $("directions").tBodies[0].replaceChildren(...rows);
    const more = replay.asked.length - rows.length;
    $("directions").caption.textContent = `Pass ${pass}${more > 0 ? `, the first ${rows.length} of ${replay.asked.length} directions` : ""}`;
  }
  legend() {
    const entry = (of, text, kind = "") => {
      const item = document.createElement("span"), mark = document.createElement("i");
      mark.className = kind; mark.style.setProperty("--of", of);
      item.append(mark, text);
      return item;
    };
    const used = [...new Set(this.drawn.map(a => a.technique))];
    const items = used.map(t => entry(`var(--c${technique(t)[1]})`, technique(t)[0]));
    if (this.missed.length) items.push(entry("var(--c1)", "the lobe, meets no light", "blocked"));
    if (this.rays.length) items.push(entry("var(--c2)", "towards a mesh or the environment"));
    if (this.blocked) items.push(entry("var(--quiet)", this.drawn.some(a => a.light == null) ? "hollow: meets no light" : "hollow: blocked", "blocked"));
    if (this.rings().length) items.push(entry("var(--c1)", "the ring drawn in the first pass, thick in the cap", "line"));
    const lobes = this.models.filter(r => r.point.model in LOBES).map(r => LOBES[r.point.model]);
    if (this.point) items.push(entry("var(--ink)", "n, wo", "line"));
    if (lobes.length) items.push(entry("var(--accent)", lobes.join(" and "), "line"));
    if (this.sample.caps.length && this.point) items.push(entry("var(--good)", "lights' caps, by the number of the sphere", "line"));
    $("legend").replaceChildren(...items);
  }
  draw() {
    const canvas = $("hemisphere"), box = canvas.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    if (!this.sample || !box.width) return;
    canvas.width = box.width * ratio; canvas.height = box.height * ratio;
    const context = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    const of = name => style.getPropertyValue(name).trim();
    context.scale(ratio, ratio);
    context.lineCap = context.lineJoin = "round";
    if (!this.point) {
      context.fillStyle = of("--quiet"); context.textAlign = "center"; context.font = "1rem system-ui, sans-serif";
      context.fillText("no point that reflects", box.width / 2, box.height / 2);
      return;
    }
    // A frame with the normal up and the direction to the eye in front.
    const n = unit(this.point.n), wo = this.sample.replays.find(r => r.point).direction.map(x => -x);
    let front = mix(wo, 1, n, -dot(wo, n));
    front = Math.hypot(...front) > 1e-4 ? unit(front) : unit(cross(n, Math.abs(n[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
    const side = cross(n, front);
    const local = w => [dot(w, side), dot(w, front), dot(w, n)];
    const radius = Math.min(box.width / 2.35, box.height / 1.62), cx = box.width / 2, cy = box.height * 0.5 + radius * 0.5 * Math.cos(this.lift);
    const [ct, st, cl, sl] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.lift), Math.sin(this.lift)];
    // x to the right, y up, z towards the reader.
    const see = ([a, b, c]) => {
      const x = ct * a - st * b, y = st * a + ct * b;
      return [cx + radius * x, cy - radius * (c * cl - y * sl), y * cl + c * sl];
    };
    const path = (points, close) => {
      context.beginPath();
      points.forEach((p, i) => { const [x, y] = see(p); i ? context.lineTo(x, y) : context.moveTo(x, y); });
      if (close) context.closePath();
    };
    const around = f => Array.from({ length: 73 }, (_, i) => f(i / 72 * 2 * Math.PI));
    const line = (colour, width, alpha = 1) => { context.strokeStyle = colour; context.lineWidth = width; context.globalAlpha = alpha; context.stroke(); context.globalAlpha = 1; };
    // The ground, circles of height and meridians.
    path(around(t => [Math.cos(t), Math.sin(t), 0]), true);
    context.fillStyle = of("--panel"); context.fill(); line(of("--quiet"), 1.4);
    for (const height of [30, 60]) {
      const z = Math.sin(height * Math.PI / 180), r = Math.cos(height * Math.PI / 180);
      path(around(t => [r * Math.cos(t), r * Math.sin(t), z]), true); line(of("--line"), 1);
    }
    for (let k = 0; k < 6; k++) {
      const t = k * Math.PI / 6;
      path(Array.from({ length: 37 }, (_, i) => [Math.cos(i * Math.PI / 36) * Math.cos(t), Math.cos(i * Math.PI / 36) * Math.sin(t), Math.sin(i * Math.PI / 36)]));
      line(of("--line"), 1);
    }
    this.caps(local, path, line, context, of, see);
    for (const { point, direction } of this.models) this.lobe(local, direction.map(x => -x), unit(point.n), point, path, line, context, of);
    for (const { wr, around, cap, theta } of this.rings()) {
      // The nearest and the farthest ring that meet the cap, and the one that was drawn.
      const ring = angle => (path(Array.from({ length: 181 }, (_, i) => local(around(angle, i / 180 * 2 * Math.PI)))), angle);
      const apart = Math.acos(Math.max(-1, Math.min(1, dot(wr, cap.to)))), tau = Math.acos(cap.cos);
      context.setLineDash([2, 4]);
      for (const angle of [apart - tau, apart + tau]) if (angle > 0 && angle < Math.PI / 2) { ring(angle); line(of("--quiet"), 1); }
      context.setLineDash([]);
      ring(theta); line(of("--c1"), 1, 0.6);
      const turns = Array.from({ length: 721 }, (_, i) => around(theta, i / 720 * 2 * Math.PI));
      context.lineWidth = 4; context.strokeStyle = of("--c1");
      for (let i = 0; i < 720; i++) if (dot(turns[i], cap.to) >= cap.cos && dot(turns[i + 1], cap.to) >= cap.cos) {
        path([local(turns[i]), local(turns[i + 1])]); context.stroke();
      }
    }
    const arrow = (w, label, colour, reach = 1) => {
      const p = local(w), from = see([0, 0, 0]), to = see(p.map(x => reach * x));
      context.beginPath(); context.moveTo(from[0], from[1]); context.lineTo(to[0], to[1]); line(colour, 2.4);
      context.fillStyle = colour; context.font = "italic 600 1.05rem Georgia, serif"; context.textAlign = "center";
      const end = see(p.map(x => (reach + 0.13) * x));
      // What lies behind a letter would make it hard to read.
      context.strokeStyle = of("--ground"); context.lineWidth = 4; context.strokeText(label, end[0], end[1] + 5);
      context.fillText(label, end[0], end[1] + 5);
    };
    arrow(n, "n", of("--ink"), 1.08);
    arrow(wo, "wo", of("--ink"), 1.08);
    // The farthest first; below the ground, directions of `uniform` are fainter.
    const many = this.drawn.length > 24;
    const marks = this.drawn.map(a => ({ a, p: local(a.found.wi) })).map(m => ({ ...m, at: see(m.p) })).sort((l, r) => l.at[2] - r.at[2]);
    const origin = see([0, 0, 0]);
    const thin = this.missed.length > 24;
    for (const wi of this.missed) {
      const at = see(local(wi));
      context.beginPath(); context.moveTo(origin[0], origin[1]); context.lineTo(at[0], at[1]);
      context.setLineDash([2, 5]); line(of("--c1"), thin ? 0.8 : 1.6, thin ? 0.35 : 1); context.setLineDash([]);
      context.beginPath(); context.arc(at[0], at[1], thin ? 2.6 : 5, 0, 7);
      context.fillStyle = of("--ground"); context.fill(); line(of("--c1"), thin ? 1 : 2, thin ? 0.5 : 1);
    }
    for (const { a, p, at } of marks) {
      const colour = of(`--c${technique(a.technique)[1]}`), blocked = a.found.occluded;
      context.globalAlpha = p[2] < 0 ? 0.35 : 1;
      context.beginPath(); context.moveTo(origin[0], origin[1]); context.lineTo(at[0], at[1]);
      if (blocked) context.setLineDash([5, 5]);
      context.strokeStyle = colour; context.lineWidth = many ? 0.8 : 2;
      if (many) context.globalAlpha *= 0.35;
      context.stroke(); context.setLineDash([]);
      context.globalAlpha = p[2] < 0 ? 0.35 : 1;
      context.beginPath(); context.arc(at[0], at[1], many ? 3.4 : 6, 0, 7);
      if (blocked) { context.fillStyle = of("--ground"); context.fill(); context.lineWidth = many ? 1.4 : 2.4; context.stroke(); }
      else { context.fillStyle = colour; context.fill(); }
    }
    context.globalAlpha = 1;
    for (const ray of this.rays) {
      const at = see(local(ray));
      context.beginPath(); context.moveTo(origin[0], origin[1]); context.lineTo(at[0], at[1]);
      line(of("--c2"), this.rays.length > 24 ? 0.8 : 2, this.rays.length > 24 ? 0.35 : 1);
      context.beginPath(); context.arc(at[0], at[1], this.rays.length > 24 ? 3.4 : 6, 0, 7); context.fillStyle = of("--c2"); context.fill();
    }
  }
  /** What each light covers of the hemisphere, as far as it is above the ground. */
  caps(local, path, line, context, of, see) {
    for (const cap of this.sample.caps) {
      const axis = local(cap.to), cos = cap.cos, sin = Math.sqrt(Math.max(0, 1 - cos * cos));
      const a = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), b = cross(axis, a);
      const rim = Array.from({ length: 49 }, (_, i) => {
        const t = i / 48 * 2 * Math.PI;
        return mix(mix(axis, cos, a, sin * Math.cos(t)), 1, b, sin * Math.sin(t));
      });
      if (rim.every(p => p[2] < 0)) continue;
      const above = rim.map(p => { const r = Math.hypot(p[0], p[1]); return p[2] < 0 && r > 0 ? [p[0] / r, p[1] / r, 0] : p; });
      path(above, true);
      context.globalAlpha = 0.25; context.fillStyle = of("--good"); context.fill(); context.globalAlpha = 1;
      line(of("--good"), 1.8);
      const top = rim.map(see).reduce((a, b) => b[1] < a[1] ? b : a);
      context.font = "600 .8rem system-ui, sans-serif"; context.textAlign = "center";
      context.strokeStyle = of("--ground"); context.lineWidth = 3; context.strokeText(cap.sphere + 1, top[0], top[1] - 11);
      context.fillStyle = of("--good"); context.fillText(cap.sphere + 1, top[0], top[1] - 11);
      // A small light is a point of the hemisphere: a ring shows where.
      const spot = see(axis);
      if (Math.hypot(...see(rim[0]).map((x, i) => i < 2 ? x - spot[i] : 0)) < 5) {
        context.beginPath(); context.arc(spot[0], spot[1], 8, 0, 7); line(of("--good"), 1.5);
      }
    }
  }
  /** The density of the BRDF's sampling over its greatest, as a radius: slices through its axis. */
  lobe(local, wo, n, { model, alpha }, path, line, context, of) {
    if (!(model in LOBES)) return;
    const phong = model === "phong";
    const axis = local(phong ? mix(n, 2 * dot(wo, n), wo, -1) : n);
    const a = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), b = cross(axis, a);
    // Where the lobe has fallen to a thousandth.
    const most = Math.acos(Math.min(1, 0.001 ** (1 / alpha)));
    for (let slice = 0; slice < 6; slice++) {
      const t = slice * Math.PI / 6, across = mix(a, Math.cos(t), b, Math.sin(t));
      const points = Array.from({ length: 81 }, (_, i) => {
        const angle = (i / 40 - 1) * most, r = Math.max(0, Math.cos(angle)) ** alpha;
        return mix(axis, r * Math.cos(angle), across, r * Math.sin(angle));
      }).map(p => p[2] < 0 ? [p[0], p[1], 0] : p);
      path([[0, 0, 0], ...points, [0, 0, 0]]);
      context.globalAlpha = 0.05; context.fillStyle = of("--accent"); context.fill(); context.globalAlpha = 1;
      line(of("--accent"), 1.3, 0.75);
    }
  }
  /** The rings of a Phong lobe that `product` drew in the first pass, each with the cap that it crosses. */
  rings() {
    const first = this.shown[0];
    if (!first || first.point.model !== "phong") return [];
    const n = unit(first.point.n), wo = first.direction.map(x => -x), wr = unit(mix(n, 2 * dot(wo, n), wo, -1));
    const a = unit(cross(wr, Math.abs(wr[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), b = cross(wr, a);
    const around = (angle, turn) => mix(wr, Math.cos(angle), mix(a, Math.cos(turn), b, Math.sin(turn)), Math.sin(angle));
    return first.asked.filter(ask => ask.found && ask.technique === "lobe").flatMap(ask => {
      const cap = this.sample.caps.find(c => c.sphere === ask.sphere);
      return cap ? [{ wr, around, cap, theta: Math.acos(Math.max(-1, Math.min(1, dot(wr, ask.found.wi)))) }] : [];
    });
  }
}

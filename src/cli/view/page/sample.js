// One sample as a drawing: the hemisphere above the point, what is looked from, the lobe, the lights' caps, and each direction
// that was drawn, by its technique, with what was in its way.

const $ = id => document.getElementById(id);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const l = Math.hypot(...a); return a.map(x => x / l); };
const mix = (a, s, b, t) => a.map((x, i) => s * x + t * b[i]);

/** How the techniques are called and coloured. */
const TECHNIQUES = { cone: ["towards a light's cone", 0], cap: ["a light's cap by the cosine", 3], brdf: ["the BRDF's lobe", 1], lobe: ["the lobe inside a light's cap", 1], sphere: ["the whole sphere", 2] };
/** Others by their own name. */
const technique = name => TECHNIQUES[name] ?? [name, 3];

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
    this.point = replays.find(r => r.point)?.point;
    this.drawn = replays.flatMap(r => r.asked).filter(a => a.found);
    // Rays to lights that are told one by one are drawn with them.
    const told = this.drawn.map(a => a.found.wi);
    this.rays = sample.rays.filter(ray => !told.some(wi => dot(wi, ray) > 1 - 1e-6));
    this.asked = replays.reduce((n, r) => n + r.asked.length, 0);
    this.blocked = this.drawn.filter(a => a.found.occluded).length;
    $("sample-title").textContent = `Pixel ${sample.x}, ${sample.y}`;
    const passes = replays.length === 1 ? `Pass ${sample.pass}` : `Passes ${sample.pass} to ${sample.pass + replays.length - 1}`;
    const radiance = replays.reduce((sum, r) => mix(sum, 1, r.radiance, 1 / replays.length), [0, 0, 0]);
    const far = this.drawn.some(a => a.light == null) ? "meet no light" : "are blocked";
    const untold = replays.some(r => r.meshes_untold);
    const light = `Radiance ${radiance.map(x => x.toPrecision(3)).join(", ")}.`;
    const spheres = !this.asked && untold ? "" : `of ${this.asked} directions${untold ? " to other lights" : ""} ${this.drawn.length} can bring light, and ${this.blocked} of these ${far}. `;
    const others = untold ? `${this.rays.length} rays were traced in all, also to large meshes; whether they arrived is in the radiance. ` : "";
    $("sample-says").textContent = this.point ? `${passes}, ${sample.estimator}: ${spheres}${others}${light}`
      : `${passes}: the ray meets nothing that reflects. ${light}`;
    $("sample-text").textContent = sample.text;
    this.legend();
    this.draw();
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
    if (this.rays.length) items.push(entry("var(--c2)", "towards a mesh or the environment"));
    if (this.blocked) items.push(entry("var(--quiet)", this.drawn.some(a => a.light == null) ? "hollow: meets no light" : "hollow: blocked", "blocked"));
    if (this.point) items.push(entry("var(--ink)", "n, wo", "line"), entry("var(--accent)", this.point.model === "diffuse" ? "lobe (cosine)" : this.point.model === "phong" ? "lobe" : this.point.model, "line"));
    if (this.sample.caps.length && this.point) items.push(entry("var(--good)", "lights' caps", "line"));
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
    this.lobe(local, wo, n, path, line, context, of);
    const arrow = (w, label, colour, reach = 1) => {
      const p = local(w), from = see([0, 0, 0]), to = see(p.map(x => reach * x));
      context.beginPath(); context.moveTo(from[0], from[1]); context.lineTo(to[0], to[1]); line(colour, 2.4);
      context.fillStyle = colour; context.font = "italic 600 1.05rem Georgia, serif"; context.textAlign = "center";
      const end = see(p.map(x => (reach + 0.13) * x));
      context.fillText(label, end[0], end[1] + 5);
    };
    arrow(n, "n", of("--ink"), 1.08);
    arrow(wo, "wo", of("--ink"), 1.08);
    // The farthest first; below the ground, directions of `uniform` are fainter.
    const many = this.drawn.length > 24;
    const marks = this.drawn.map(a => ({ a, p: local(a.found.wi) })).map(m => ({ ...m, at: see(m.p) })).sort((l, r) => l.at[2] - r.at[2]);
    const origin = see([0, 0, 0]);
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
      // A small light is a point of the hemisphere: a ring shows where.
      const spot = see(axis);
      if (Math.hypot(...see(rim[0]).map((x, i) => i < 2 ? x - spot[i] : 0)) < 5) {
        context.beginPath(); context.arc(spot[0], spot[1], 8, 0, 7); line(of("--good"), 1.5);
      }
    }
  }
  /** The density of the BRDF's sampling over its greatest, as a radius: slices through its axis. */
  lobe(local, wo, n, path, line, context, of) {
    // Of models with microfacets no lobe is drawn: theirs is no power of a cosine.
    if (!["diffuse", "phong"].includes(this.point.model)) return;
    const alpha = this.point.alpha, phong = alpha > 1;
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
}

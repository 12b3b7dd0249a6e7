// The race: what takes part, the curves of error against time, and who leads.

const MOST = 4;
const FIRST = [["light", "sobol"], ["brdf", "sobol"], ["mis", "sobol"], ["product", "sobol"]];
/** What a reference is called. */
const REFERENCES = { file: "the given file", mis: "two renders by mis", oracle: "the f64 oracle, slow" };
/** An error as people write it. */
export const amount = x => x >= 0.001 && x < 1e4 ? String(+x.toPrecision(3)) : x.toExponential(1);
export const colour = index => getComputedStyle(document.documentElement).getPropertyValue(`--c${index}`).trim();
export const name = racer => `${racer.estimator}, ${racer.adaptive ? "adaptive " : ""}${racer.sampler}`;
const $ = id => document.getElementById(id);

export class RacePanel {
  /** `start(race)` asks for a race; `refused(what, field)` shows what is wrong and where. */
  constructor(start, refused) {
    this.choices = FIRST.map(([estimator, sampler]) => ({ estimator, sampler, adaptive: false }));
    $("race-add").onclick = () => { this.choices.push({ ...this.choices.at(-1) }); this.draw(); };
    $("race-start").onclick = () => {
      const by = $("race-by").value, field = $("race-seconds"), seconds = Number(field.value);
      if (by !== "file" && !(seconds >= 0.1 && seconds <= 3600)) return refused("A reference takes 0.1 to 3600 seconds.", field);
      $("race-choices").open = false;
      this.waits = true;
      start({ racers: this.choices, ...(by === "file" ? {} : { by, seconds }) });
    };
    this.refused = what => {
      if (!this.waits) return false;
      this.waits = false;
      // The server says which racer it means, if it means one.
      const row = $("race-setup").children[/^racer (\d)/.exec(what)?.[1] - 1];
      refused(what, row?.querySelector("select") ?? $("race-start"));
      return true;
    };
    $("race-by").onchange = () => { $("race-seconds-label").hidden = $("race-by").value === "file"; };
    new ResizeObserver(() => this.curves()).observe($("curves"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.curves());
  }
  known(hello) {
    const again = this.hello;
    this.hello = hello;
    if (!again) {
      $("race-by").replaceChildren(...Object.entries(REFERENCES).filter(([by]) => by !== "file" || hello.reference).map(([by, text]) => new Option(text, by)));
      $("race-seconds").value = hello.reference_seconds;
      $("race-by").onchange();
    }
    this.draw();
  }
  /** The rows of settings. */
  draw() {
    const setup = $("race-setup");
    setup.replaceChildren(...this.choices.map((choice, i) => {
      const row = document.createElement("div");
      row.className = "row";
      row.style.setProperty("--of", `var(--c${i})`);
      const select = (key, options, label) => {
        const box = document.createElement("select");
        box.setAttribute("aria-label", `${label} of racer ${i + 1}`);
        box.append(...options.map(option => new Option(option, option, false, option === choice[key])));
        box.onchange = () => { choice[key] = box.value; };
        return box;
      };
      const adaptive = document.createElement("label"), tick = document.createElement("input");
      tick.type = "checkbox"; tick.checked = choice.adaptive;
      tick.onchange = () => { choice.adaptive = tick.checked; };
      adaptive.append(tick, "adaptive");
      const away = document.createElement("button");
      away.textContent = "×"; away.className = "close"; away.disabled = this.choices.length <= 2;
      away.setAttribute("aria-label", `Take racer ${i + 1} away`);
      away.onclick = () => { this.choices.splice(i, 1); this.draw(); };
      row.append(select("estimator", this.hello.estimators, "Estimator"), select("sampler", this.hello.samplers, "Sampler"), adaptive, away);
      return row;
    }));
    $("race-add").disabled = this.choices.length >= MOST;
  }
  /** What the server tells of the race; null where there is none. */
  take(race) {
    const had = this.race;
    this.race = race;
    if (race) this.waits = false;
    $("race-running").hidden = !race;
    $("race-start").textContent = race ? "Start again" : "Start";
    if (!race) { if (had) $("race-choices").open = true; return; }
    const { reference, racers, rims } = race;
    const far = `${reference.seconds?.toFixed(1)} of ${+reference.of?.toPrecision(3)} s`;
    $("race-says").textContent = !reference.ready
      ? `First the reference: ${reference.by === "oracle" ? `the f64 oracle, ${reference.samples} spp` : "two pictures by mis, of other seeds"}, ${far}.`
      : `Each racer has rendered for the same time. Errors are against ${{ file: "the given file", mis: "two pictures by mis", oracle: "the f64 oracle" }[reference.by]}`
        + (reference.noise == null ? "." : "; the dashed line is its own noise, as far as it can tell.") + (rims ? ` Not counted: ${rims} pixels at the rims of lights.` : "");
    for (const id of ["race-views", "curves", "standings"]) $(id).hidden = !reference.ready;
    if (reference.ready) this.standings(racers);
    this.curves();
  }
  standings(racers) {
    const best = racers.map(r => r.curve.at(-1)).filter(Boolean).sort((a, b) => a[1] - b[1])[0];
    $("standings").tBodies[0].replaceChildren(...racers.map((racer, i) => {
      const row = document.createElement("tr"), last = racer.curve.at(-1);
      row.style.setProperty("--of", `var(--c${i})`);
      // Monte Carlo errors fall as one over the time: the factor in error is one in time.
      const factor = last && best ? last[1] / best[1] : NaN;
      const cells = ["", name(racer), racer.least === racer.most ? racer.least : `${racer.least}–${racer.most}`,
        last ? amount(last[1]) : "–", !last ? "–" : factor <= 1 ? "leads" : `${factor < 10 ? factor.toFixed(1) : factor < 1e4 ? +factor.toPrecision(2) : amount(factor)} ×`];
      row.append(...cells.map(text => Object.assign(document.createElement("td"), { textContent: text })));
      return row;
    }));
  }
  /** relMSE against seconds, both logarithmic. */
  curves() {
    const canvas = $("curves"), box = canvas.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    if (!this.race || !box.width) return;
    canvas.width = box.width * ratio; canvas.height = box.height * ratio;
    const context = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--quiet"), line = style.getPropertyValue("--line");
    context.scale(ratio, ratio);
    const points = this.race.racers.flatMap(r => r.curve).filter(([t, e]) => t > 0 && e > 0);
    const noise = this.race.reference.noise;
    if (!points.length) return;
    const range = values => {
      const low = Math.log10(Math.min(...values)), high = Math.log10(Math.max(...values));
      return [low - 0.05, Math.max(high + 0.05, low + 0.5)];
    };
    const [x0, x1] = range(points.map(p => p[0])), [y0, y1] = range([...points.map(p => p[1]), ...(noise > 0 ? [noise] : [])]);
    const left = 58, right = box.width - 10, top = 12, bottom = box.height - 40;
    const x = t => left + (Math.log10(t) - x0) / (x1 - x0) * (right - left);
    const y = e => bottom - (Math.log10(e) - y0) / (y1 - y0) * (bottom - top);
    context.font = "12px system-ui, sans-serif"; context.fillStyle = ink; context.lineWidth = 1;
    const ticks = (low, high) => {
      const found = [];
      const steps = high - low > 2.5 ? [1] : high - low > 1.2 ? [1, 3] : [1, 2, 5];
      for (let decade = Math.floor(low); decade <= high; decade++) for (const step of steps) {
        const value = step * 10 ** decade;
        if (Math.log10(value) >= low && Math.log10(value) <= high) found.push(value);
      }
      return found;
    };
    context.strokeStyle = line; context.textAlign = "center";
    for (const t of ticks(x0, x1)) {
      context.beginPath(); context.moveTo(x(t), top); context.lineTo(x(t), bottom); context.stroke();
      context.fillText(t >= 0.1 ? +t.toPrecision(2) : t.toPrecision(1), x(t), bottom + 16);
    }
    context.textAlign = "right";
    for (const e of ticks(y0, y1)) {
      context.beginPath(); context.moveTo(left, y(e)); context.lineTo(right, y(e)); context.stroke();
      context.fillText(e >= 0.01 && e < 1000 ? +e.toPrecision(2) : e.toExponential(0), left - 6, y(e) + 4);
    }
    context.textAlign = "center";
    context.fillText("seconds of rendering, each racer", (left + right) / 2, box.height - 6);
    context.save(); context.translate(11, (top + bottom) / 2); context.rotate(-Math.PI / 2); context.fillText("relMSE", 0, 0); context.restore();
    if (noise > 0) {
      context.setLineDash([5, 4]); context.strokeStyle = ink;
      context.beginPath(); context.moveTo(left, y(noise)); context.lineTo(right, y(noise)); context.stroke(); context.setLineDash([]);
    }
    this.race.racers.forEach((racer, i) => {
      context.strokeStyle = context.fillStyle = colour(i); context.lineWidth = 2.2; context.lineJoin = "round";
      context.beginPath();
      racer.curve.forEach(([t, e], k) => k ? context.lineTo(x(t), y(e)) : context.moveTo(x(t), y(e)));
      context.stroke();
      const last = racer.curve.at(-1);
      if (last) { context.beginPath(); context.arc(x(last[0]), y(last[1]), 3.5, 0, 7); context.fill(); }
    });
  }
}
